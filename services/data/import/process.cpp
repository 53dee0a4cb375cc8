#include "services/data/import/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "common/core/descriptor.h"
#include "common/core/log.h"
#include "services/data/import/confine.h"
#include "services/data/import/files.h"

extern char** environ;

namespace telesplat::data {
namespace {

// Returns the path of the import program: beside this one, else its name, for $PATH.
std::string import_program() {
  std::error_code error;
  const auto beside = std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / kImportProgram;
  return !error && std::filesystem::exists(beside, error) ? beside.string() : kImportProgram;
}

// Returns the program's environment: our process id and the sanitizers' variables only.
std::vector<std::string> surroundings() {
  std::vector<std::string> out{fmt::format("{}={}", kParentVariable, getpid())};
  for (char** variable = environ; *variable; ++variable)
    for (const char* known : {"ASAN_OPTIONS=", "LSAN_OPTIONS=", "TSAN_OPTIONS=", "UBSAN_OPTIONS="})
      if (std::string_view(*variable).starts_with(known)) out.emplace_back(*variable);
  return out;
}

// Starts the program, which writes to `output`, and sends it the files (files.h).
Result<pid_t> start_import(std::vector<std::string> words, const std::vector<std::string>& files, int output) {
  const std::string format = words[0], path = words[1];
  static const bool told = [] {
    if (const std::string missing = not_confined(); !missing.empty())
      log::warn("files are read with less protection: this kernel does not offer {}", missing);
    return true;
  }();
  static_cast<void>(told);
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
    return Error{fmt::format("{}: no socket for reading it: {}", path, std::strerror(errno))};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  words.insert(words.begin(), import_program());
  const std::string& program = words[0];
  std::vector<std::string> variables = surroundings();
  std::vector<char*> arguments, environment;
  for (std::string& word : words) arguments.push_back(word.data());
  for (std::string& variable : variables) environment.push_back(variable.data());
  arguments.push_back(nullptr), environment.push_back(nullptr);
  pid_t child = -1;
  const int failed = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (!failed) send_files(ends[0], files);
  close(ends[0]);
  if (failed)
    return Error{fmt::format("{}: the program that reads {} files, {}, cannot be started: {}", path, format, program,
                             std::strerror(failed))};
  return child;
}

// Waits for the program's end. Error: it crashed, did not end, gave up, or is missing.
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

}  // namespace

namespace {

// Runs the program; its report lies in memory.
Result<Descriptor> report_of(const std::string& reader, std::vector<std::string> words,
                             const std::vector<std::string>& files) {
  const std::string format = words[0], path = words[1];
  Descriptor output(memfd_create("telesplat-import", MFD_CLOEXEC));
  if (!output.valid()) return Error{fmt::format("{}: no memory file for reading it: {}", path, std::strerror(errno))};
  const auto child = start_import(std::move(words), files, output.get());
  if (!child) return child.error();
  if (const Status ended = end_import(*child, reader, format, path); !ended) return ended.error();
  return output;
}

}  // namespace

Result<Mesh> import(const std::string& reader, std::vector<std::string> words, const std::vector<std::string>& files) {
  const auto report = report_of(reader, words, files);
  return report ? read_import_report(report->get(), words[1], words[0]) : report.error();
}

Result<ElevationRaster> import_heights(std::vector<std::string> words, const std::vector<std::string>& files) {
  const auto report = report_of("GDAL's raster", words, files);
  return report ? read_heights_report(report->get(), words[1]) : report.error();
}

Result<StreamedVolume> import_volume(const std::string& reader, std::vector<std::string> words,
                                     const std::vector<std::string>& files, uint64_t most_bytes,
                                     const ReadProgress& progress) {
  const std::string format = words[0], path = words[1];
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    return Error{fmt::format("{}: no pipe for reading it: {}", path, std::strerror(errno))};
  Descriptor from(ends[0]), into(ends[1]);
  fcntl(into.get(), F_SETPIPE_SZ, 1 << 20);  // fewer switches between the processes; a smaller pipe works, too
  const auto child = start_import(std::move(words), files, into.get());
  if (!child) return child.error();
  into.close();
  auto received = receive_volume(from.get(), most_bytes, path, progress);
  from.close();  // ends the program if it still writes
  const auto ended = end_import(*child, reader, format, path);
  if (received) return std::move(*received);  // a result counts even if the program ended badly
  if (!ended) return ended.error();
  return Error{fmt::format("{}: what {} gave of it is incomplete", path, kImportProgram)};
}

}  // namespace telesplat::data
