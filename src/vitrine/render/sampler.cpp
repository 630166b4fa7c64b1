#include "render/sampler.h"

#include <array>

namespace vitrine {
namespace {

std::uint32_t reverse_bits(std::uint32_t v) {
    v = (v << 16) | (v >> 16);
    v = ((v & 0x00ff00ffu) << 8) | ((v & 0xff00ff00u) >> 8);
    v = ((v & 0x0f0f0f0fu) << 4) | ((v & 0xf0f0f0f0u) >> 4);
    v = ((v & 0x33333333u) << 2) | ((v & 0xccccccccu) >> 2);
    return ((v & 0x55555555u) << 1) | ((v & 0xaaaaaaaau) >> 1);
}

/// Owen scrambling of a number whose bits are reversed (Laine and Karras 2011, constants of Burley
/// 2020, listing 2).
std::uint32_t scramble_reversed(std::uint32_t v, std::uint32_t seed) {
    v += seed;
    v ^= v * 0x6c50b47cu;
    v ^= v * 0xb82f1e52u;
    v ^= v * 0xc7afe638u;
    v ^= v * 0x8d22f6e6u;
    return v;
}

/// Second Sobol dimension byte by byte: table[k][b] is the exclusive or of its columns in byte k.
struct SecondDimension {
    std::array<std::array<std::uint32_t, 256>, 4> table{};
    SecondDimension() {
        std::array<std::uint32_t, 32> column{};
        column[0] = 0x80000000u;
        for (std::size_t i = 1; i < 32; ++i) column[i] = column[i - 1] ^ (column[i - 1] >> 1);
        for (std::size_t k = 0; k < 4; ++k) {
            for (std::uint32_t b = 0; b < 256; ++b) {
                for (std::size_t bit = 0; bit < 8; ++bit) {
                    if ((b >> bit) & 1u) table[k][b] ^= column[8 * k + bit];
                }
            }
        }
    }
};

const SecondDimension kSecond;

}  // namespace

Vec2f sobol_pair(std::uint32_t index, std::uint32_t seed) {
    // Shuffle the order, then scramble each dimension.
    const std::uint32_t i = reverse_bits(scramble_reversed(reverse_bits(index), seed));
    const std::uint32_t x = reverse_bits(i);
    const std::uint32_t y = kSecond.table[0][i & 255u] ^ kSecond.table[1][(i >> 8) & 255u] ^
                            kSecond.table[2][(i >> 16) & 255u] ^ kSecond.table[3][i >> 24];
    const std::uint32_t seed_x = seed * 0x9e3779b9u + 0x7f4a7c15u;
    const std::uint32_t seed_y = seed * 0x85ebca6bu + 0xc2b2ae35u;
    const std::uint32_t sx = reverse_bits(scramble_reversed(reverse_bits(x), seed_x));
    const std::uint32_t sy = reverse_bits(scramble_reversed(reverse_bits(y), seed_y));
    return {static_cast<float>(sx >> 8) * 0x1p-24f, static_cast<float>(sy >> 8) * 0x1p-24f};
}

}  // namespace vitrine
