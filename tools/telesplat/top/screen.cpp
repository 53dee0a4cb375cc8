#include "tools/telesplat/top/screen.h"

#define NCURSES_WIDECHAR 1
#include <curses.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace telesplat::launcher {
namespace {

SCREEN* screen = nullptr;  // the terminal is one

constexpr short kCurvePair = 1, kGoodPair = 2, kAlarmPair = 3, kDimPair = 4;

attr_t attributes(TopStyle style) {
  const bool colours = has_colors();
  switch (style) {
    case TopStyle::kTitle:
      return A_BOLD;
    case TopStyle::kHead:
      return A_UNDERLINE | A_BOLD;
    case TopStyle::kDim:
      return colours ? COLOR_PAIR(kDimPair) : A_NORMAL;
    case TopStyle::kGood:
      return colours ? COLOR_PAIR(kGoodPair) : A_NORMAL;
    case TopStyle::kAlarm:
      return colours ? COLOR_PAIR(kAlarmPair) | A_BOLD : A_REVERSE | A_BOLD;
    case TopStyle::kCurve:
      return colours ? COLOR_PAIR(kCurvePair) : A_NORMAL;
    case TopStyle::kPlain:
      break;
  }
  return A_NORMAL;
}

}  // namespace

std::unique_ptr<TopScreen> TopScreen::open() {
  screen = newterm(nullptr, stdout, stdin);
  if (!screen) return nullptr;
  set_term(screen);
  cbreak();
  noecho();
  curs_set(0);
  keypad(stdscr, TRUE);
  if (has_colors()) {
    start_color();
    use_default_colors();
    init_pair(kCurvePair, COLOR_CYAN, -1);
    init_pair(kGoodPair, COLOR_GREEN, -1);
    init_pair(kAlarmPair, COLOR_WHITE, COLOR_RED);
    init_pair(kDimPair, COLOR_BLUE, -1);
  }
  return std::unique_ptr<TopScreen>(new TopScreen);
}

TopScreen::~TopScreen() {
  endwin();
  delscreen(screen);
  screen = nullptr;
}

int TopScreen::width() const { return COLS; }

void TopScreen::draw(const std::vector<TopLine>& lines, const std::string& foot) {
  erase();
  const int room = std::max(LINES - 1, 0);
  const bool all = int(lines.size()) <= room;
  const int shown = all ? int(lines.size()) : std::max(room - 1, 0);
  for (int y = 0; y < shown; ++y) {
    move(y, 0);
    for (const TopSpan& span : lines[size_t(y)]) {
      attrset(attributes(span.style));
      addstr(span.text.c_str());
    }
  }
  attrset(A_NORMAL);
  if (!all) mvaddstr(shown, 0, fmt::format("... {} more lines", int(lines.size()) - shown).c_str());
  attrset(A_REVERSE);
  mvaddnstr(LINES - 1, 0, foot.c_str(), std::max(COLS - 1, 0));
  attrset(A_NORMAL);
  refresh();
}

int TopScreen::key(int timeout_ms) {
  timeout(timeout_ms);
  const int c = getch();
  return c == ERR ? 0 : c == KEY_RESIZE ? kResized : c;
}

}  // namespace telesplat::launcher
