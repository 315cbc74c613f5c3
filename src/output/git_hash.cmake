# Write OUTPUT, a source file with the hash of the checkout, unless it says so already. Run at every build: a hash taken when
# the build was configured would be that of another program.
execute_process(COMMAND git describe --always --dirty --abbrev=12
  OUTPUT_VARIABLE hash OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
set(text "namespace corpuscle {\nextern const char source_hash[];\nconst char source_hash[] = \"${hash}\";\n}\n")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} present)
endif()
if(NOT "${present}" STREQUAL "${text}")
  file(WRITE ${OUTPUT} "${text}")
endif()
