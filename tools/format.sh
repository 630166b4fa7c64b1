#!/usr/bin/env bash
# Formats every C++ file with clang-format 14; with --check only says what would change.
set -euo pipefail
cd "$(dirname "$0")/.."
mode=(-i)
[[ "${1:-}" == "--check" ]] && mode=(--dry-run --Werror)
git ls-files -z -- '*.h' '*.cpp' | xargs -0 clang-format-14 "${mode[@]}"
