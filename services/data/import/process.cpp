#include "services/data/import/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "services/data/import/report.h"

extern char** environ;

namespace telesplat::data {
namespace {

// The import program lies beside this one; else it is looked for in $PATH.
std::string import_program() {
  std::error_code error;
  const auto beside = std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / kImportProgram;
  return !error && std::filesystem::exists(beside, error) ? beside.string() : kImportProgram;
}

}  // namespace

Result<pid_t> start_import(int input, int output, std::vector<std::string> words) {
  const std::string format = words[0], path = words[1];
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (input >= 0)
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  else
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  words.insert(words.begin(), import_program());
  const std::string& program = words[0];
  std::string parent = fmt::format("{}={}", kParentVariable, getpid());
  std::vector<char*> surroundings{parent.data()};
  for (char** variable = environ; *variable; ++variable) surroundings.push_back(*variable);
  surroundings.push_back(nullptr);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = -1;
  const int failed = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), surroundings.data());
  posix_spawn_file_actions_destroy(&actions);
  if (failed)
    return Error{fmt::format("{}: the program that reads {} files, {}, cannot be started: {}", path, format, program,
                             std::strerror(failed))};
  return child;
}

Status end_import(pid_t child, const std::string& reader, const std::string& format, const std::string& path) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return Error{fmt::format("{}: lost the process that reads it: {}", path, std::strerror(errno))};
  if (WIFSIGNALED(status))
    return Error{fmt::format("{}: is damaged: {} reader {}", path, reader,
                             WTERMSIG(status) == SIGALRM ? "did not end" : "crashed on it")};
  if (WEXITSTATUS(status) == 127)
    return Error{fmt::format("{}: {}, which reads {} files, is missing", path, kImportProgram, format)};
  if (WEXITSTATUS(status) == kCutOffExit) return Error{fmt::format("{}: was cut off while it was read", path)};
  if (WEXITSTATUS(status) != 0) return Error{fmt::format("{}: is damaged: {} reader gave up on it", path, reader)};
  return ok_status();
}

Result<Mesh> import(const std::string& reader, std::vector<std::string> words, int input) {
  const std::string format = words[0], path = words[1];
  const int output = memfd_create("telesplat-import", MFD_CLOEXEC);
  if (output < 0) return Error{fmt::format("{}: no memory file for reading it: {}", path, std::strerror(errno))};
  auto result = [&]() -> Result<Mesh> {
    const auto child = start_import(input, output, std::move(words));
    if (!child) return child.error();
    if (auto status = end_import(*child, reader, format, path); !status) return status.error();
    return read_import_report(output, path, format);
  }();
  close(output);
  return result;
}

}  // namespace telesplat::data
