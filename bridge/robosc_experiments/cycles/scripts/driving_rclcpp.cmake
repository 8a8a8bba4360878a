# Builds `driving.cpp` with rclcpp. `@...@` is filled in.
cmake_minimum_required(VERSION 3.16)
project(driving LANGUAGES C CXX)

set(CMAKE_C_STANDARD 99)
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
add_compile_options(@flags@)

find_package(rclcpp REQUIRED)
find_package(geometry_msgs REQUIRED)

add_executable(driving driving.cpp @p@.c)
target_include_directories(driving PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_link_libraries(driving PRIVATE rclcpp::rclcpp ${geometry_msgs_TARGETS} m)
