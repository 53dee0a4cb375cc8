# cmake --install: the programs, and the manual pages and shell completion that they print.
include(GNUInstallDirs)

foreach(program telesplat telesplat-data telesplat-display telesplat-health telesplat-import telesplat-master
    telesplat-packer telesplat-sampler telesplat-viewer telesplat-wan-relay)
  if(TARGET ${program})
    install(TARGETS ${program})
  endif()
endforeach()

set(manuals ${CMAKE_BINARY_DIR}/manuals)
install(CODE "
  file(REMOVE_RECURSE \"${manuals}\")
  execute_process(COMMAND \"${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/telesplat\" man --out \"${manuals}\"
    COMMAND_ERROR_IS_FATAL ANY)
  foreach(shell bash zsh fish)
    execute_process(COMMAND \"${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/telesplat\" completion \${shell}
      OUTPUT_FILE \"${manuals}/telesplat.\${shell}\" COMMAND_ERROR_IS_FATAL ANY)
  endforeach()")
install(DIRECTORY ${manuals}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 FILES_MATCHING PATTERN "*.1")
install(FILES ${manuals}/telesplat.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
  RENAME telesplat)
install(FILES ${manuals}/telesplat.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions RENAME _telesplat)
install(FILES ${manuals}/telesplat.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
