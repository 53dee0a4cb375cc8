#include "tools/telesplat/run/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

#include "common/core/clock.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"

namespace telesplat::launcher {

Result<ChildProcess> ChildProcess::start(const std::string& name, const std::string& program,
                                         const std::vector<std::string>& arguments, const std::string& log_path,
                                         int nice_value, bool told) {
  const Descriptor log(::open(log_path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, kPrivate));
  if (!log.valid()) return Error{fmt::format("{}: {}", log_path, std::strerror(errno))};
  int out[2], in[2] = {-1, -1};
  if (pipe2(out, O_CLOEXEC) != 0) return Error{fmt::format("{}: no pipe: {}", name, std::strerror(errno))};
  Descriptor from_child(out[0]), child_out(out[1]);
  if (told && socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, in) != 0)
    return Error{fmt::format("{}: no pair of sockets: {}", name, std::strerror(errno))};
  Descriptor to_child(in[0]), child_in(in[1]);
  std::vector<char*> argv;
  argv.push_back(const_cast<char*>(program.c_str()));
  for (const auto& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  const pid_t launcher = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != launcher) _exit(1);  // the launcher died in between
    if (nice_value) setpriority(PRIO_PROCESS, 0, nice_value);
    const int null = ::open("/dev/null", O_RDONLY);
    dup2(told ? child_in.get() : null, 0);
    dup2(child_out.get(), 1);
    dup2(log.get(), 2);
    execv(program.c_str(), argv.data());
    dprintf(2, "telesplat: cannot start %s: %s\n", program.c_str(), std::strerror(errno));
    _exit(127);
  }
  if (pid < 0) return Error{fmt::format("{}: cannot fork: {}", name, std::strerror(errno))};
  fcntl(from_child.get(), F_SETFL, O_NONBLOCK);
  ChildProcess child;
  child.name_ = name;
  child.pid_ = pid;
  child.stdout_ = std::move(from_child);
  child.stdin_ = std::move(to_child);
  return child;
}

ChildProcess::ChildProcess(ChildProcess&& o) noexcept { *this = std::move(o); }

ChildProcess& ChildProcess::operator=(ChildProcess&& o) noexcept {
  std::swap(name_, o.name_);
  std::swap(pid_, o.pid_);
  std::swap(stdout_, o.stdout_);
  std::swap(stdin_, o.stdin_);
  std::swap(partial_line_, o.partial_line_);
  std::swap(exit_code_, o.exit_code_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0 && !ended()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

void ChildProcess::tell(const std::string& line) {
  if (!stdin_.valid()) return;
  const std::string whole = line + '\n';
  [[maybe_unused]] const ssize_t sent = ::send(stdin_.get(), whole.data(), whole.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
}

std::vector<std::string> ChildProcess::read_lines() {
  std::vector<std::string> lines;
  char buffer[4096];
  ssize_t n = 0;
  while ((n = ::read(stdout_.get(), buffer, sizeof buffer)) > 0) {
    for (ssize_t i = 0; i < n; ++i) {
      if (buffer[i] == '\n')
        lines.push_back(std::exchange(partial_line_, {}));
      else if (partial_line_.size() < 4096)
        partial_line_ += buffer[i];
    }
  }
  return lines;
}

bool ChildProcess::ended() {
  if (exit_code_ || pid_ <= 0) return true;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_)
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return exit_code_.has_value();
}

void ChildProcess::signal(int number) {
  if (!ended()) kill(pid_, number);
}

void ChildProcess::finish(double patience_s) {
  for (const int next : {SIGTERM, SIGKILL, 0}) {
    // A second Ctrl-C shortens the wait, but the child always ends.
    const auto waits = [&] { return next == 0 || !net::stop_requested(); };
    for (const double until = monotonic_s() + patience_s; !ended() && monotonic_s() < until && waits();) {
      read_lines();  // a full pipe must not keep it from ending
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    if (ended() || next == 0) return;
    kill(pid_, next);
  }
}

}  // namespace telesplat::launcher
