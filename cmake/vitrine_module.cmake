# vitrine_library(NAME base SRCS a.cpp LINK lower_floor Eigen3::Eigen TESTS a_test.cpp SLOW_TESTS b_test.cpp
#                 TEST_LINK synthetic)
#
# One library per floor, `vitrine_<NAME>`. LINK takes floor names (only lower ones: the root forbids
# cycles) and imported targets. TESTS become `<NAME>_test` (label fast), SLOW_TESTS become
# `<NAME>_slow_test` (label slow).

add_library(vitrine_flags INTERFACE)
target_compile_options(vitrine_flags INTERFACE -Wall -Wextra -Wshadow -Wno-psabi)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # False alarms of GCC 12: uninitialised storage in every Eigen array returned by value, and
    # overlapping copies in std::string's operator+ (GCC bug 105329).
    target_compile_options(vitrine_flags INTERFACE -Wno-maybe-uninitialized -Wno-restrict)
endif()
# Same bits on every machine and for every thread count: no fused or reassociated arithmetic.
target_compile_options(vitrine_flags INTERFACE -ffp-contract=off)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
    target_compile_options(vitrine_flags INTERFACE -msse4.2)
endif()
if(VITRINE_WERROR)
    target_compile_options(vitrine_flags INTERFACE -Werror)
endif()
if(VITRINE_SANITIZE)
    target_compile_options(vitrine_flags INTERFACE -fsanitize=${VITRINE_SANITIZE}
                                                   -fno-omit-frame-pointer)
    target_link_options(vitrine_flags INTERFACE -fsanitize=${VITRINE_SANITIZE})
endif()

function(vitrine_link target scope)
    foreach(item IN LISTS ARGN)
        if(NOT TARGET ${item} AND item MATCHES "^[a-z]+$")
            target_link_libraries(${target} ${scope} vitrine_${item})
        else()
            target_link_libraries(${target} ${scope} ${item})
        endif()
    endforeach()
endfunction()

add_custom_target(unit_tests)  # the fast test programs, for the sanitizer build

function(vitrine_test target label)
    cmake_parse_arguments(ARG "" "" "SRCS;LINK" ${ARGN})
    add_executable(${target} ${ARG_SRCS})
    vitrine_link(${target} PRIVATE ${ARG_LINK} GTest::gtest GTest::gtest_main vitrine_flags)
    add_test(NAME ${target} COMMAND ${target})
    set_tests_properties(${target} PROPERTIES LABELS ${label})
    if(label STREQUAL fast)
        add_dependencies(unit_tests ${target})
    endif()
endfunction()

function(vitrine_library)
    cmake_parse_arguments(ARG "" "NAME" "SRCS;LINK;PRIVATE_LINK;TESTS;SLOW_TESTS;TEST_LINK" ${ARGN})
    set(lib vitrine_${ARG_NAME})
    add_library(${lib} STATIC ${ARG_SRCS})
    target_include_directories(${lib} PUBLIC ${PROJECT_SOURCE_DIR}/src/vitrine)
    vitrine_link(${lib} PUBLIC ${ARG_LINK})
    vitrine_link(${lib} PRIVATE ${ARG_PRIVATE_LINK})
    target_link_libraries(${lib} PRIVATE vitrine_flags)
    if(VITRINE_TESTS AND ARG_TESTS)
        vitrine_test(${ARG_NAME}_test fast SRCS ${ARG_TESTS} LINK ${ARG_NAME} ${ARG_TEST_LINK})
    endif()
    if(VITRINE_TESTS AND ARG_SLOW_TESTS)
        vitrine_test(${ARG_NAME}_slow_test slow SRCS ${ARG_SLOW_TESTS}
                     LINK ${ARG_NAME} ${ARG_TEST_LINK})
    endif()
endfunction()
