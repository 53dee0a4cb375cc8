#include "tools/telesplat/top/layout.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "tools/common/text_table.h"
#include "tools/telesplat/control/status_text.h"
#include "tools/telesplat/top/tables.h"

namespace telesplat::launcher {
namespace {

constexpr int kLeastWidth = 40;
constexpr double kSilent_s = 3;  // processes report every second
constexpr const char* kBlocks[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
constexpr const char kLetters[] = "_.,-~=+#";

// A line of words that wraps; `first` stands before it.
void add_words(std::vector<TopLine>& out, const std::string& first, const std::vector<TopSpan>& words, size_t width) {
  TopLine line{{first, TopStyle::kDim}};
  size_t used = tools::width_of(first);
  bool any = false;
  for (const TopSpan& word : words) {
    const std::string text = tools::shortened(word.text, std::max<size_t>(width - tools::width_of(first), 3));
    const size_t more = tools::width_of(text) + (any ? 2 : 0);
    if (any && used + more > width) {
      out.push_back(std::move(line));
      line = {{std::string(tools::width_of(first), ' ')}};
      used = tools::width_of(first);
      any = false;
    }
    if (any) line.push_back({"  "});
    line.push_back({text, word.style});
    used += tools::width_of(text) + (any ? 2 : 0);
    any = true;
  }
  out.push_back(std::move(line));
}

std::string age(double seconds) {
  const auto s = uint64_t(std::max(0.0, seconds));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
}

// "async" where all viewers have the same; else how many have which.
std::string couplings(const TopState& state) {
  std::map<std::string, int> count;
  for (const TopProcess* p : state.alive("viewer"))
    if (const std::string text = coupling_of(*p); !text.empty()) ++count[text];
  if (count.empty()) return {};
  if (count.size() == 1) return count.begin()->first;
  std::vector<std::string> out;
  for (const auto& [text, n] : count) out.push_back(fmt::format("{} x {}", n, text));
  return fmt::format("{}", fmt::join(out, ", "));
}

void add_head(std::vector<TopLine>& out, const TopState& state, const TopLayout& o) {
  std::string title = state.scene.empty() ? "no data server yet" : state.scene;
  if (!state.kind.empty() && !state.scene.starts_with(state.kind)) title += " (" + state.kind + ")";
  std::vector<TopSpan> words{{title, TopStyle::kTitle}};
  if (state.started_at_s > 0)
    words.push_back({fmt::format("since {}, for {}", local_time(state.started_at_s, o.wall_s),
                                 age(o.wall_s - state.started_at_s))});
  add_words(out, "", words, size_t(o.width));
  words = {{fmt::format("epoch {:.0f}", state.epoch)},
           {fmt::format("views {:.0f} complete, {:.0f} in flight", state.frames_completed, state.frames_in_flight)}};
  if (const std::string text = couplings(state); !text.empty()) words.push_back({"coupling " + text});
  add_words(out, "", words, size_t(o.width));
}

// What is wrong now, then what was.
void add_errors(std::vector<TopLine>& out, const TopState& state, const TopHistory& history, const TopLayout& o) {
  std::vector<TopSpan> words;
  if (o.unanswered_s > 0)
    words.push_back({fmt::format("the master has not answered for {:.0f} s", o.unanswered_s), TopStyle::kAlarm});
  for (const char* role : {"data", "packer", "sampler"})
    if (state.alive(role).empty()) words.push_back({fmt::format("no {} is here", role), TopStyle::kAlarm});
  for (const TopProcess& p : state.processes) {
    if (p.alive && p.silent_s > kSilent_s)
      words.push_back({fmt::format("{} is silent for {:.1f} s", p.name, p.silent_s), TopStyle::kAlarm});
    if (const double waits_s = p.value("waits_s").value_or(0); p.alive && waits_s > 0)
      words.push_back({fmt::format("{} waits for a view update, {:.1f} s", p.name, waits_s), TopStyle::kAlarm});
  }
  for (const auto& [what, error] : history.errors(o.now_s))
    words.push_back({fmt::format("{:.0f} {}", error.count, what), error.recent ? TopStyle::kAlarm : TopStyle::kPlain});
  if (words.empty()) words.push_back({"none", TopStyle::kGood});
  add_words(out, "errors  ", words, size_t(o.width));
}

double most_of(const std::deque<double>& values) {
  double out = 0;
  for (const double v : values)
    if (std::isfinite(v)) out = std::max(out, v);
  return out;
}

// Ends of axes are numbers that people like.
double axis_end(double most) {
  if (!(most > 0)) return 1;
  const double power = std::pow(10, std::floor(std::log10(most)));
  for (const double step : {1.0, 2.0, 5.0})
    if (most <= step * power) return step * power;
  return 10 * power;
}

// Beside each other where there is room.
void add_curves(std::vector<TopLine>& out, const TopProcess& viewer, const TopHistory& history, const TopLayout& o) {
  const auto* v = history.viewer(viewer.name);
  if (!v || v->fps.size() < 2) return;
  const size_t width = size_t(o.width), each = std::min(TopHistory::kSeconds, (width - 4) / 2 - 16);
  TopLine line{{"    "}};
  for (const auto& [name, values, unit] :
       {std::tuple{"fps", &v->fps, ""}, std::tuple{"latency", &v->latency_ms, " ms"}}) {
    const double most = axis_end(most_of(*values));
    const std::vector<double> copy(values->begin(), values->end());
    const size_t shown = std::min(each, copy.size());
    line.push_back({fmt::format("{} ", name), TopStyle::kDim});
    line.push_back({curve(copy, shown, most, o.unicode), TopStyle::kCurve});
    line.push_back({fmt::format(" {:g}{}  ", most, unit), TopStyle::kDim});
  }
  out.push_back(std::move(line));
}

}  // namespace

const char* name_of(TopSort sort) {
  return sort == TopSort::kName ? "name" : sort == TopSort::kBusy ? "busy" : "tiles/s";
}

TopSort next(TopSort sort) {
  return sort == TopSort::kName ? TopSort::kBusy : sort == TopSort::kBusy ? TopSort::kRate : TopSort::kName;
}

std::string curve(std::span<const double> values, size_t width, double most, bool unicode) {
  std::string out(width - std::min(width, values.size()), ' ');
  for (const double v : values.last(std::min(width, values.size()))) {
    if (!std::isfinite(v)) {
      out += ' ';
      continue;
    }
    const auto step = size_t(std::clamp(v / most, 0.0, 1.0) * 7.999);
    if (unicode)
      out += kBlocks[step];
    else
      out += kLetters[step];
  }
  return out;
}

std::string plain_text(const TopLine& line) {
  std::string out;
  for (const TopSpan& span : line) out += span.text;
  out.erase(out.find_last_not_of(' ') + 1);
  return out;
}

std::vector<TopLine> top_lines(const TopState& state, const TopHistory& history, const TopLayout& layout) {
  TopLayout o = layout;
  o.width = std::max(o.width, kLeastWidth);
  std::vector<TopLine> out;
  add_head(out, state, o);
  add_errors(out, state, history, o);
  for (const TopTable& table : top_tables(state, o.sort)) {
    auto lines = table_lines(table, size_t(o.width));
    if (lines.empty()) continue;
    out.emplace_back();
    out.push_back(std::move(lines.front()));
    for (size_t i = 1; i < lines.size(); ++i) {
      out.push_back(std::move(lines[i]));
      if (table.with_curves) add_curves(out, *table.rows[i - 1], history, o);
    }
  }
  return out;
}

}  // namespace telesplat::launcher
