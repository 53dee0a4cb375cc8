#include "tools/telesplat/movie/piped_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

namespace telesplat::launcher {
namespace {

constexpr int kLook_ms = 100;  // how often should_stop is asked
constexpr size_t kMostText = 64 << 10;

// The end of what was written to a file in memory.
std::string text_of(int file) {
  const off_t size = lseek(file, 0, SEEK_END);
  if (size <= 0) return {};
  std::string out(std::min(size_t(size), kMostText), '\0');
  const ssize_t n = pread(file, out.data(), out.size(), size - off_t(out.size()));
  out.resize(n > 0 ? size_t(n) : 0);
  return out;
}

// In the child. Nothing but system calls.
[[noreturn]] void become(const std::vector<char*>& argv, const char* directory, int input, int output, int errors,
                         pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // it died in between
  signal(SIGPIPE, SIG_DFL);
  dup2(input, 0);
  dup2(output, 1);
  dup2(errors, 2);
  if (!directory || chdir(directory) == 0) execv(argv[0], argv.data());
  dprintf(2, "cannot be started: %s\n", std::strerror(errno));
  _exit(127);
}

}  // namespace

Result<PipedProcess> PipedProcess::start(const std::string& program, const std::vector<std::string>& arguments,
                                         const char* directory) {
  PipedProcess out;
  out.output_ = memfd_create("output", MFD_CLOEXEC);
  out.errors_ = memfd_create("errors", MFD_CLOEXEC);
  int input[2];
  if (out.output_ < 0 || out.errors_ < 0 || pipe2(input, O_CLOEXEC) != 0)
    return Error{fmt::format("{}: no pipe: {}", program, std::strerror(errno))};
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const auto& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) become(argv, directory, input[0], out.output_, out.errors_, parent);
  ::close(input[0]);
  out.input_ = input[1];
  if (pid < 0) return Error{fmt::format("{}: cannot fork: {}", program, std::strerror(errno))};
  fcntl(out.input_, F_SETFL, O_NONBLOCK);
  out.pid_ = pid;
  return out;
}

PipedProcess::PipedProcess(PipedProcess&& o) noexcept { *this = std::move(o); }

PipedProcess& PipedProcess::operator=(PipedProcess&& o) noexcept {
  std::swap(pid_, o.pid_);
  std::swap(input_, o.input_);
  std::swap(output_, o.output_);
  std::swap(errors_, o.errors_);
  return *this;
}

PipedProcess::~PipedProcess() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  close_input();
  if (output_ >= 0) ::close(output_);
  if (errors_ >= 0) ::close(errors_);
}

void PipedProcess::close_input() {
  if (input_ >= 0) ::close(input_);
  input_ = -1;
}

bool PipedProcess::write(std::span<const std::byte> bytes, const ShouldStop& should_stop) {
  while (!bytes.empty()) {
    if (should_stop()) return false;
    pollfd ready{input_, POLLOUT, 0};
    if (poll(&ready, 1, kLook_ms) <= 0) continue;
    const ssize_t n = ::write(input_, bytes.data(), bytes.size());  // SIGPIPE is ignored
    if (n >= 0)
      bytes = bytes.subspan(size_t(n));
    else if (errno != EAGAIN && errno != EINTR)
      return false;
  }
  return true;
}

int PipedProcess::finish(const ShouldStop& should_stop) {
  close_input();
  if (pid_ < 0) return -1;  // it was waited for already
  int status = 0;
  while (waitpid(pid_, &status, WNOHANG) == 0) {
    if (should_stop()) return -1;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string PipedProcess::output() const { return text_of(output_); }

std::string PipedProcess::last_error_line() const {
  std::string text = text_of(errors_);
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  return text.substr(text.find_last_of("\r\n") + 1);
}

}  // namespace telesplat::launcher
