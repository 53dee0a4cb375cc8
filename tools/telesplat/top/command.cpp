// `telesplat top`: a running session on a terminal, as it goes.
#include <langinfo.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <thread>

#include "common/core/clock.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/control/choice.h"
#include "tools/telesplat/control/orders.h"
#include "tools/telesplat/top/layout.h"
#include "tools/telesplat/top/screen.h"

namespace telesplat::launcher {
namespace {

constexpr double kPeriod_s = 1, kUnanswered_s = 3;
constexpr int kLook_ms = 50, kPlainWidth = 120;

struct TopOptions {
  SessionChoice session;
  bool plain = false, once = false;
};

options::Table table(TopOptions& o) {
  return joined({{.flag = "--plain",
                  .value = &o.plain,
                  .help = "print text, a block a second, also on a terminal; without one this is so anyway"},
                 {.flag = "--once", .value = &o.once, .help = "print one block as text and end"}},
                session_rows(o.session));
}

bool speaks_unicode() { return std::strcmp(nl_langinfo(CODESET), "UTF-8") == 0; }

// Of text that is printed.
int plain_width() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const char* columns = std::getenv("COLUMNS");
  const int told = columns ? std::atoi(columns) : 0;
  return told > 0 ? std::min(told, 1000) : kPlainWidth;
}

/// What is known of the session; asks for more once a second.
class Watch {
 public:
  explicit Watch(ControlClient& client) : client_(client) {}

  /// The first answer is waited for. Error: none came.
  Status begin() {
    const auto answer = client_.ask("status", kPatience_s);
    if (!answer) return answer.error();
    const auto json = nlohmann::ordered_json::parse(*answer, nullptr, false);
    if (!json.is_object()) return Error{"the master's answer is not a status"};
    take(json);
    asked_s_ = heard_s_;
    return ok_status();
  }

  /// True: something new is known.
  bool look() {
    const double now_s = monotonic_s();
    if (now_s - asked_s_ >= kPeriod_s) {
      asked_s_ = now_s;
      client_.request_status();
    }
    const auto status = client_.poll_status();
    if (status) take(nlohmann::ordered_json(*status));
    return status.has_value();
  }

  bool ended() const { return client_.nobody_there(); }
  std::vector<TopLine> lines(int width, TopSort sort, bool unicode) const {
    const double now_s = monotonic_s(), silent_s = now_s - heard_s_;
    return top_lines(state_, history_,
                     {.width = width,
                      .sort = sort,
                      .unicode = unicode,
                      .wall_s = double(std::time(nullptr)),
                      .now_s = now_s,
                      .unanswered_s = silent_s > kUnanswered_s ? silent_s : 0});
  }

 private:
  void take(const nlohmann::ordered_json& status) {
    heard_s_ = monotonic_s();
    state_ = read_top_state(status);
    history_.add(state_, heard_s_);
  }

  ControlClient& client_;
  TopState state_;
  TopHistory history_;
  double asked_s_ = 0, heard_s_ = 0;
};

void print(const Watch& watch, bool unicode) {
  for (const TopLine& line : watch.lines(plain_width(), TopSort::kName, unicode))
    std::printf("%s\n", plain_text(line).c_str());
  std::fflush(stdout);
}

void watch_plainly(Watch& watch, bool unicode) {
  print(watch, unicode);
  for (double printed_s = monotonic_s(); !watch.ended() && !net::stop_requested();) {
    std::this_thread::sleep_for(std::chrono::milliseconds(kLook_ms));
    const bool news = watch.look();
    if (!news && monotonic_s() - printed_s < kUnanswered_s) continue;
    printed_s = monotonic_s();
    std::printf("\n");
    print(watch, unicode);
  }
}

void watch_on_screen(Watch& watch, TopScreen& screen, bool unicode) {
  bool paused = false;
  TopSort sort = TopSort::kName;
  std::vector<TopLine> lines;
  const auto draw = [&](bool anew) {
    if (anew) lines = watch.lines(screen.width(), sort, unicode);
    screen.draw(lines, std::string("q quit  p ") + (paused ? "go on (paused)" : "pause") +
                           "  s sort samplers: " + name_of(sort));
  };
  draw(true);
  for (double drawn_s = monotonic_s(); !watch.ended() && !net::stop_requested();) {
    const int key = screen.key(kLook_ms);
    if (key == 'q' || key == 'Q') return;
    if (key == 'p' || key == ' ') paused = !paused;
    if (key == 's') sort = next(sort);
    const bool news = watch.look();  // also while what is shown stays
    if (key == 0 && (paused || (!news && monotonic_s() - drawn_s < kPeriod_s))) continue;
    drawn_s = monotonic_s();
    draw(!paused || key == 's' || key == TopScreen::kResized);
  }
}

int top(TopOptions o, const options::Given& given) {
  log::initialise("top", "error");
  std::setlocale(LC_ALL, "");
  std::setlocale(LC_NUMERIC, "C");
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code, net::any_role());
  if (!client) return exit_code;
  net::install_signal_handlers();
  Watch watch(*client);
  if (const Status s = watch.begin(); !s) return tools::complain(s.error(), 1);
  const bool unicode = speaks_unicode();
  if (o.once) {
    print(watch, unicode);
    return 0;
  }
  const bool terminal = isatty(STDIN_FILENO) && isatty(STDOUT_FILENO);
  if (const auto screen = o.plain || !terminal ? nullptr : TopScreen::open())
    watch_on_screen(watch, *screen, unicode);
  else
    watch_plainly(watch, unicode);
  if (watch.ended()) std::printf("the session has ended\n");
  return 0;
}

}  // namespace

Command top_command() { return make_command("top", "a running session on the terminal, as it goes", table, top); }

}  // namespace telesplat::launcher
