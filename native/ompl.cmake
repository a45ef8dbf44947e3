# Finds OMPL 1.5 to 2.x, however it was packaged, and makes the target plancurate_ompl of it.

find_package(ompl QUIET CONFIG)
if(NOT ompl_FOUND)
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(ompl QUIET IMPORTED_TARGET ompl)
  endif()
endif()

if(NOT ompl_FOUND)
  message(FATAL_ERROR
    "OMPL, the library of motion planners (version 1.5 or newer), was not found. Install it and try again:\n"
    "  Debian, Ubuntu:  apt install libompl-dev\n"
    "  conda:           conda install -c conda-forge ompl\n"
    "  macOS:           brew install ompl\n"
    "Installed somewhere unusual? Set CMAKE_PREFIX_PATH to that place.")
endif()

add_library(plancurate_ompl INTERFACE)
if(TARGET ompl::ompl)  # OMPL 1.6 and newer
  target_link_libraries(plancurate_ompl INTERFACE ompl::ompl)
elseif(TARGET PkgConfig::ompl)
  target_link_libraries(plancurate_ompl INTERFACE PkgConfig::ompl)
else()
  # Debian's list goes on with Boost libraries that only a -dev package outside its dependencies provides; the
  # linker finds what OMPL itself needs of them.
  list(GET OMPL_LIBRARIES 0 ompl_library)
  target_include_directories(plancurate_ompl SYSTEM INTERFACE ${OMPL_INCLUDE_DIRS})
  target_link_libraries(plancurate_ompl INTERFACE ${ompl_library})
endif()
