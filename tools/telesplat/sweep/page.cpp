#include "tools/telesplat/sweep/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "common/core/machine.h"
#include "tools/telesplat/sweep/cells/cells.h"
#include "tools/telesplat/sweep/page_parts.h"
#include "tools/telesplat/sweep/plot.h"
#include "tools/telesplat/sweep/tables.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kColours = 8;  // that the page's style has

bool is_number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == 0 && std::isfinite(value);  // nan has no place in an order
}

// A path as a link takes it.
std::string link_to(const std::string& path) {
  std::string out;
  for (const unsigned char c : path)
    if (std::isalnum(c) || std::string_view("-._~/").find(char(c)) != std::string_view::npos)
      out += char(c);
    else
      out += fmt::format("%{:02X}", c);
  return out;
}

/// The plots of all figures.
class Plots {
 public:
  explicit Plots(const SweepRecord& record) : record_(record), layout_(layout_of(record.grid)), noise_(noises(record)) {
    for (size_t c = 0; c < record.configurations.size(); ++c) panels_[panel_of(c)].push_back(c);
    if (layout_.across && layout_.numeric) {
      const auto& values = record.grid.axes[*layout_.across].values;
      for (size_t i = 0; i < values.size(); ++i) order_.push_back(i);
      std::stable_sort(order_.begin(), order_.end(), [&](size_t a, size_t b) {
        return std::strtod(values[a].c_str(), nullptr) < std::strtod(values[b].c_str(), nullptr);
      });
    }
  }

  std::string html() const {
    std::string out = legend() + "<div class=\"figures\">\n";
    for (const Measure& figure : main_figures()) out += row(figure);
    return out + "</div>\n";
  }

 private:
  std::string panel_of(size_t configuration) const {
    std::string out;
    for (const size_t axis : layout_.panels)
      out += fmt::format("{}{}={}", out.empty() ? "" : " ", record_.grid.axes[axis].flag,
                         record_.configurations[configuration].values[axis]);
    return out;
  }

  std::string legend() const {
    if (!layout_.across) return {};
    std::string out =
        fmt::format("<p class=\"legend\">From left to right: {}.", escaped(record_.grid.axes[*layout_.across].flag));
    if (!layout_.colours) return out + "</p>\n";
    const Axis& axis = record_.grid.axes[*layout_.colours];
    out += fmt::format(" Colours: {}: ", escaped(axis.flag));
    for (size_t i = 0; i < axis.values.size(); ++i)
      out += fmt::format("<span class=\"c{}\"><i></i>{}</span> ", i, escaped(axis.values[i]));
    return out + "</p>\n";
  }

  std::string row(const Measure& figure) const {
    double least = 1e300, most = -1e300;
    for (size_t c = 0; c < record_.configurations.size(); ++c)
      if (const auto s = record_.spread(c, figure.name))
        least = std::min(least, s->least), most = std::max(most, s->most);
    if (least > most) return {};  // nobody measured it
    const Scale scale = scale_of(least * figure.scale, most * figure.scale, figure.from_zero);
    std::string out =
        fmt::format("<section class=\"figure\"><h3>{} <small>{}</small></h3><p>{}</p><div class=\"row\">\n",
                    escaped(figure.title), escaped(figure.unit), escaped(figure.help));
    for (const auto& [title, members] : panels_) out += to_svg(plot(figure, title, members), scale) + "\n";
    return out + "</div></section>\n";
  }

  Plot plot(const Measure& figure, const std::string& title, const std::vector<size_t>& members) const {
    Plot out{.title = title, .lines = layout_.numeric};
    out.categories = layout_.across ? record_.grid.axes[*layout_.across].values : std::vector<std::string>{"all runs"};
    out.series.resize(layout_.colours ? record_.grid.axes[*layout_.colours].values.size() : 1);
    for (size_t s = 0; s < out.series.size(); ++s)
      out.series[s] = {int(s), std::vector<std::optional<PlotPoint>>(out.categories.size())};
    for (const size_t c : members) {
      const size_t series = layout_.colours ? place(*layout_.colours, c) : 0;
      const size_t category = layout_.across ? place(*layout_.across, c) : 0;
      out.series[series].points[category] = point(figure, c);
    }
    if (order_.empty()) return out;
    Plot sorted = out;
    for (size_t i = 0; i < order_.size(); ++i) {
      sorted.categories[i] = out.categories[order_[i]];
      for (size_t s = 0; s < out.series.size(); ++s) sorted.series[s].points[i] = out.series[s].points[order_[i]];
    }
    return sorted;
  }

  size_t place(size_t axis, size_t configuration) const {
    const auto& values = record_.grid.axes[axis].values;
    const auto found = std::find(values.begin(), values.end(), record_.configurations[configuration].values[axis]);
    return size_t(found - values.begin());
  }

  std::optional<PlotPoint> point(const Measure& figure, size_t configuration) const {
    const auto s = record_.spread(configuration, figure.name);
    if (!s) return std::nullopt;
    const bool noisy = std::any_of(noise_.begin(), noise_.end(), [&](const Noise& n) {
      return n.configuration == configuration && n.figure == &figure;
    });
    std::string tip = fmt::format("{}\n{}: {} {}", words(record_.grid, record_.configurations[configuration]),
                                  figure.title, text_of(figure, s->median), figure.unit);
    if (s->runs > 1)
      tip += fmt::format("\n{} to {} in {} runs", text_of(figure, s->least), text_of(figure, s->most), s->runs);
    if (noisy) tip += fmt::format("\ntoo noisy: they differ by {:.0f} %", 100 * s->relative());
    return PlotPoint{s->median * figure.scale, s->least * figure.scale, s->most * figure.scale, tip, noisy};
  }

  const SweepRecord& record_;
  PlotLayout layout_;
  std::vector<Noise> noise_;
  std::map<std::string, std::vector<size_t>> panels_;  // title -> configurations
  std::vector<size_t> order_;                          // of the values across, where they are numbers
};

std::string list_of(const char* head, const char* id, const std::vector<std::string>& lines) {
  if (lines.empty()) return {};
  std::string out = fmt::format("<section id=\"{}\"><h2>{}</h2><ul>\n", id, head);
  for (const std::string& line : lines) out += fmt::format("<li>{}</li>\n", escaped(line));
  return out + "</ul></section>\n";
}

std::string run_links(const SweepRecord& record, size_t configuration, const std::string& directory) {
  std::string out;
  for (const SweptRun& run : record.runs) {
    if (run.configuration != configuration) continue;
    std::error_code error;
    std::string target;
    for (const char* file : {"/report.html", "/summary.json"})
      if (target.empty() && std::filesystem::exists(directory + "/" + run.folder + file, error))
        target = run.folder + file;
    const bool done = run.outcome && run.outcome->done;
    const char* state = done ? "" : run.outcome ? " failed" : " open";
    out += target.empty() || !done ? fmt::format("{}{} ", run.repetition, state)
                                   : fmt::format("<a href=\"{}\">{}</a> ", link_to(target), run.repetition);
  }
  return out;
}

std::string table_of(const SweepRecord& record, const std::string& directory) {
  std::vector<const Measure*> measured;
  for (const Measure& f : main_figures())
    for (size_t c = 0; c < record.configurations.size(); ++c)
      if (record.spread(c, f.name)) {
        measured.push_back(&f);
        break;
      }
  const auto noise = noises(record);
  std::string out = "<section><h2>Configurations</h2><div class=\"wide\"><table><thead><tr>";
  for (const Axis& axis : record.grid.axes) out += fmt::format("<th class=\"f\">{}</th>", escaped(axis.flag));
  for (const Measure* f : measured)
    out += fmt::format("<th title=\"{}\">{}</th>", escaped(f->title), escaped(f->brief));
  out += "<th>runs</th></tr></thead><tbody>\n";
  for (size_t c = 0; c < record.configurations.size(); ++c) {
    out += "<tr>";
    for (const std::string& value : record.configurations[c].values)
      out += fmt::format("<td class=\"f\">{}</td>", escaped(value));
    for (const Measure* f : measured) {
      const auto spread = record.spread(c, f->name);
      const bool noisy = std::any_of(noise.begin(), noise.end(),
                                     [&](const Noise& n) { return n.configuration == c && n.figure == f; });
      out += fmt::format("<td{}>{}</td>", noisy ? " class=\"noisy\" title=\"too noisy\"" : "",
                         spread ? escaped(text_of(*f, *spread)) + (noisy ? " !" : "") : "-");
    }
    out += fmt::format("<td>{}</td></tr>\n", run_links(record, c, directory));
  }
  return out +
         "</tbody></table></div><p>Median of the runs, and least..most in brackets. The numbers at the end lead to "
         "each "
         "run's report.</p></section>\n";
}

// "+3.1 (-0.2 to +6.4), p 0.06"; bold where it is a difference.
std::string difference_cell(const Cell& cell) {
  if (!cell.difference) return "<td>-</td>";
  const auto shown = [&](double v) { return fmt::format("{:+.{}f}", v * cell.figure->scale, cell.figure->decimals); };
  const auto& d = *cell.difference;
  return fmt::format("<td{}>{} ({} to {}), p {:.2g}</td>", cell.differs() ? " class=\"differs\"" : "", shown(d.mean),
                     shown(d.interval.low), shown(d.interval.high), cell.p_holm);
}

std::string differences_of(const SweepRecord& record) {
  const auto cells = cells_of(record);
  if (std::none_of(cells.begin(), cells.end(), [](const Cell& c) { return c.difference.has_value(); })) return {};
  const size_t count = record.configurations.size();
  std::string out = fmt::format(
      "<section><h2>Differences from {}</h2><p>Whether other configurations differ from the first one, or the runs "
      "only "
      "happened to: difference of the means, its 95 % interval, and p, the share of sweeps without any difference in "
      "which chance alone would show as large a one. Bold: p is below {}. Welch's t test over the runs; p raised after "
      "Holm for all comparisons of a figure.</p><div class=\"wide\"><table><thead><tr><th class=\"f\"></th>",
      escaped(words(record.grid, record.configurations.front())), kDiffers);
  for (size_t i = 0; i < cells.size(); i += count)
    out +=
        fmt::format("<th>{} <small>{}</small></th>", escaped(cells[i].figure->brief), escaped(cells[i].figure->unit));
  out += "</tr></thead><tbody>\n";
  for (size_t c = 1; c < count; ++c) {
    out += fmt::format("<tr><td class=\"f\">{}</td>", escaped(words(record.grid, record.configurations[c])));
    for (size_t i = 0; i < cells.size(); i += count) out += difference_cell(cells[i + c]);
    out += "</tr>\n";
  }
  return out + "</tbody></table></div></section>\n";
}

std::string load_line(const SweepRecord& record) {
  std::vector<double> others;
  for (const SweptRun& run : record.runs)
    if (run.outcome) others.push_back(100 * run.outcome->load.others_cpu);
  if (others.empty()) return "nothing has run yet";
  const Spread s = spread_of(others);
  return fmt::format("others used {:.0f} % of the machine's cores (median of the runs; {:.0f} to {:.0f} %)", s.median,
                     s.least, s.most);
}

std::string facts(const SweepRecord& record, const Manifest& m) {
  const auto count = std::count_if(record.runs.begin(), record.runs.end(),
                                   [](const SweptRun& r) { return r.outcome && r.outcome->done; });
  const Machine machine = this_machine();
  std::vector<std::pair<std::string, std::string>> rows{
      {"runs", fmt::format("{} of {} done: {} configurations, {} times each", count, record.runs.size(),
                           record.configurations.size(), record.grid.repeat)},
      {"scene", record.grid.scene.empty() ? "varies" : record.grid.scene},
      {"flags of all runs", record.grid.flags.empty() ? "none" : shell_line(record.grid.flags)},
      {"order", record.grid.shuffle
                    ? fmt::format("repetition after repetition, shuffled with seed {}", *record.grid.shuffle)
                    : "repetition after repetition, in the grid's order"},
      {"machine", fmt::format("{}, {} cores", machine.processor, machine.cores)},
      {"load", load_line(record)},
      {"version", m.version}};
  std::string out = "<dl>";
  for (const auto& [name, value] : rows) out += fmt::format("<dt>{}</dt><dd>{}</dd>\n", name, escaped(value));
  return out + "</dl>\n";
}

// "Sweep of lucy.ply: coupling, link"
std::string title_of(const Grid& grid) {
  std::string out = "Sweep";
  if (!grid.scene.empty()) out += " of " + std::filesystem::path(grid.scene).filename().string();
  for (size_t i = 0; i < grid.axes.size(); ++i) out += (i ? ", " : ": ") + grid.axes[i].flag;
  return out;
}

}  // namespace

PlotLayout layout_of(const Grid& grid) {
  PlotLayout out;
  const auto numeric = [&](size_t i) {
    return std::all_of(grid.axes[i].values.begin(), grid.axes[i].values.end(), is_number);
  };
  const auto better = [&](size_t i) {
    if (!out.across) return true;
    const size_t count = grid.axes[i].values.size(), best = grid.axes[*out.across].values.size();
    return numeric(i) != numeric(*out.across) ? numeric(i) && count > 1 : count >= best;
  };
  for (size_t i = 0; i < grid.axes.size(); ++i)
    if (better(i)) out.across = i;
  if (!out.across) return out;
  out.numeric = numeric(*out.across);
  for (size_t i = 0; i < grid.axes.size(); ++i) {
    if (i == *out.across) continue;
    if (!out.colours && grid.axes[i].values.size() <= kColours)
      out.colours = i;
    else
      out.panels.push_back(i);
  }
  return out;
}

std::string to_html(const SweepRecord& record, const Manifest& manifest, const std::string& directory, double skip_s) {
  std::vector<std::string> noisy;
  for (const Noise& n : noises(record)) noisy.push_back(sentence(record, n));
  std::vector<std::string> few;
  if (const std::string line = too_few(record.grid); !line.empty()) few.push_back(line);
  if (skip_s > 0) few.push_back(fmt::format("the first {} s of each run are left out (--skip)", skip_s));
  const std::string name = title_of(record.grid);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\">\n<title>{0}</title>\n<style>{1}</style></head><body>\n<h1>{0}</h1>\n"
      "{2}{8}{3}{4}<h2>Figures</h2>\n<p>Median of the runs of each configuration; whiskers from the least to the most."
      "</p>\n{5}{9}{6}<div id=\"tip\" hidden></div><script>{7}</script></body></html>\n",
      escaped(name), page_style(), facts(record, manifest), list_of("Too noisy", "noise", noisy),
      list_of("Failed", "failed", failures(record)), Plots(record).html(), table_of(record, directory), page_script(),
      list_of("Notes", "notes", few), differences_of(record));
}

}  // namespace telesplat::launcher
