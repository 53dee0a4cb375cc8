#include "client/displays/window/panel/widget_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace telesplat::viewer {

WidgetLog WidgetLog::from_environment() {
  const char* path = std::getenv(kVariable);
  return WidgetLog(path ? path : "");
}

void WidgetLog::begin_build() {
  part_.clear();
  for (auto& [name, w] : widgets_) w.here = w.reachable = false;
}

void WidgetLog::seen(std::string_view kind, std::string_view name, const Rect& rect, const Rect& visible, bool used) {
  std::string whole = fmt::format("{}{}{}", part_, part_.empty() ? "" : "/", name);
  std::replace_if(
      whole.begin(), whole.end(), [](char c) { return c == '\t' || c == '\n'; }, ' ');
  Widget& w = widgets_[whole];
  if (w.here) return;
  const float x = (rect.left + rect.right) / 2, y = (rect.top + rect.bottom) / 2;
  w.kind = kind, w.rect = rect, w.here = true;
  w.reachable = x >= visible.left && x < visible.right && y >= visible.top && y < visible.bottom;
  if (used && !w.on) ++w.uses;
  w.on = used;
}

void WidgetLog::end_build() {
  std::string now = text();
  if (now == written_) return;
  const std::string next = path_ + ".next";
  std::ofstream out(next, std::ios::binary);
  out << now;
  out.close();
  if (out && std::rename(next.c_str(), path_.c_str()) == 0) written_ = std::move(now);
}

std::string WidgetLog::text() const {
  std::string out;
  for (const auto& [name, w] : widgets_)
    out += fmt::format("{}\t{}\t{:.0f}\t{:.0f}\t{:.0f}\t{:.0f}\t{:d}\t{:d}\t{}\n", name, w.kind, w.rect.left,
                       w.rect.top, w.rect.right, w.rect.bottom, w.here, w.reachable, w.uses);
  return out;
}

}  // namespace telesplat::viewer
