#include "tests/integration/commands/here.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "common/net/service.h"
#include "tests/support/patience.h"
#include "tools/telesplat/command.h"

namespace telesplat::test {

Said said_by(const std::function<int()>& program) {
  const TemporaryFolder folder;
  const std::string out = folder / "out", err = folder / "err";
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    alarm(unsigned(patient(60)));
    for (const auto& [path, fd] : {std::pair{out, 1}, {err, 2}})
      dup2(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600), fd);
    setenv("TELESPLAT_RUNTIME", (folder / "runtime").c_str(), 1);
    const int code = net::guarded_main(program);
    std::fflush(nullptr);
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(out), read_text(err)};
}

Said telesplat(const std::vector<std::string>& arguments) {
  return said_by([&] {
    using namespace launcher;
    const auto commands = with_manuals(
        "", {run_command(), view_command(), control_command(), inspect_command(), build_command(), compare_command(),
             movie_command(), report_command(), sweep_command(), cache_command(), keys_command(), presets_command()});
    return run_commands("telesplat", "", commands, arguments);
  });
}

}  // namespace telesplat::test
