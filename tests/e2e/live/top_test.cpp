// `telesplat top` of a running session: as text, and on a terminal.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// Runs `telesplat top` on a pseudo-terminal of 80 columns: looks, pauses, sorts, makes it larger, and ends it by the
// key or the signal that is named. Exit code of the program; 100: something is wrong.
constexpr const char* kScript = R"(
import fcntl, os, pty, select, signal, struct, sys, termios, time
binary, master, ending = sys.argv[1:]
fd, terminal = pty.openpty()
def size(columns, lines):
    fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
size(80, 30)
before = termios.tcgetattr(terminal)
pid = os.fork()
if pid == 0:
    os.login_tty(terminal)
    os.environ["TERM"] = "xterm-256color"
    os.environ["LC_ALL"] = "C.UTF-8"
    os.execv(binary, [binary, "top", "--master", master])
seen = b""
def until(text, seconds=20):
    global seen
    end = time.monotonic() + seconds
    while text not in seen:
        if time.monotonic() > end: print("no", text, "in", seen[-3000:]); sys.exit(100)
        if select.select([fd], [], [], 0.1)[0]:
            try: more = os.read(fd, 65536)
            except OSError: more = b""
            if not more: break
            seen += more
    seen = seen[seen.find(text) + len(text):] if text in seen else b""
until(b"\x1b[?1049h")                      # the other screen
until(b"terrain.ply")
until(b"viewer-1")
until(b"q quit")
os.write(fd, b"p"); until(b"paused")
os.write(fd, b"p"); until(b"pause")
os.write(fd, b"s"); until(b"busy")
size(140, 40); os.kill(pid, signal.SIGWINCH); until(b"renderer")
if ending == "q": os.write(fd, b"q")
elif ending == "ctrl-c": os.write(fd, b"\x03")
else: os.system(f"{binary} ctl stop --master {master} > /dev/null")
until(b"\x1b[?1049l")                      # the screen that was there before
if ending == "stop": until(b"the session has ended")
end = time.monotonic() + 20
while time.monotonic() < end:              # its modes are set back after the screen, so they are looked at last
    done, status = os.waitpid(pid, os.WNOHANG)
    if done:
        if before != termios.tcgetattr(terminal): print("the terminal is not as it was"); sys.exit(100)
        sys.exit(os.waitstatus_to_exitcode(status) % 256)
    time.sleep(0.02)
os.kill(pid, signal.SIGKILL)
print("it does not end")
sys.exit(100)
)";

class Top : public testing::Test {
 protected:
  int on_terminal(PipelineRun& run, const std::string& ending) {
    std::ofstream(run.folder() / "terminal.py") << kScript;
    const std::string out = run.folder() / ("terminal-" + ending);
    const int code = std::system(("/usr/bin/python3 " + (run.folder() / "terminal.py") + " " + TELESPLAT_BIN +
                                  "/telesplat " + run.master() + " " + ending + " > " + out + " 2>&1")
                                     .c_str());
    said = read_text(out);
    return WEXITSTATUS(code);
  }
  std::string said;
};

TEST_F(Top, ShowsASessionAsText) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "inter_frame_ms") > 0; }));
  Program once("telesplat", {"top", "--once", "--master", run.master()}, run.folder() / "once");
  EXPECT_EQ(once.wait(), 0) << once.err();
  for (const char* text : {"terrain.ply (mesh)", "coupling async", "errors", "viewer-1", "fps", "delay ms", "sampler-1",
                           "tiles/s", "packer", "data server"})
    EXPECT_TRUE(holds(once.out(), text)) << text << " in\n" << once.out();
  EXPECT_FALSE(holds(once.out(), "\033"));

  // No terminal: a block a second, until the session ends.
  Program blocks("telesplat", {"top", "--master", run.master()}, run.folder() / "blocks");
  EXPECT_TRUE(wait_until([&] {
    const std::string out = blocks.out();
    return out.find("terrain.ply") != out.rfind("terrain.ply") && holds(out, "    fps ");
  })) << blocks.out();
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_EQ(blocks.wait(20), 0);
  EXPECT_TRUE(blocks.out().ends_with("the session has ended\n")) << blocks.out();

  Program none("telesplat", {"top", "--master", run.master()}, run.folder() / "none");
  EXPECT_EQ(none.wait(), 1) << "as ctl does";
  EXPECT_TRUE(holds(none.err(), "no master is at")) << none.err();
}

TEST_F(Top, OnATerminalKeysAndSignalsWork) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  EXPECT_EQ(on_terminal(run, "q"), 0) << said;
  EXPECT_EQ(on_terminal(run, "ctrl-c"), 0) << said;
  EXPECT_EQ(on_terminal(run, "stop"), 0) << said;
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

}  // namespace
}  // namespace telesplat::test
