#include "tools/telesplat/report/reading/run_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>

#include "common/core/check.h"
#include "common/core/utf8.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kLongestText = 200, kLongestRow = size_t{64} << 10;
constexpr double kMost = 1e12;  // a larger value is damage: no moment, size or number of a run is beyond it

double loose_number(const std::string& text) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool good = read.ec == std::errc() && read.ptr == text.data() + text.size() && std::abs(value) <= kMost;
  return good ? value : std::numeric_limits<double>::quiet_NaN();
}

namespace fs = std::filesystem;

using Names = std::vector<std::string>;

const Names kFrameNumbers{"frame",
                          "t_s",
                          "begin_s",
                          "inter_frame_ms",
                          "construction_ms",
                          "wait_ms",
                          "motion_to_photon_ms",
                          "still",
                          "points_drawn",
                          "points_cached",
                          "update_age_ms",
                          "view_error_m",
                          "view_error_deg",
                          "px",
                          "py",
                          "pz",
                          "qw",
                          "qx",
                          "qy",
                          "qz"};
const Names kUpdateNumbers{"request",     "requested_s", "complete_s",  "latency_ms",
                           "start_up_ms", "points",      "extra_points"};
const Names kTileNumbers{"frame", "samples", "kept", "bytes_sent", "encode_end_s", "packed_s", "published_s"};
const Names kQualityNumbers{"frame", "t_s", "psnr_db", "ssim", "flip", "hole_fraction", "object_pixels"};

// lacks: the page's part that needs the table.
std::optional<LooseTable> read(const std::string& directory, const char* name, const char* lacks, const Names& numbers,
                               const Names& texts, std::vector<std::string>& notes) {
  std::error_code error;
  const std::string path = directory + "/" + name;
  if (!lies_within(directory, name)) {
    notes.push_back(fmt::format("{} is a symbolic link and not looked into: {}", name, lacks));
    return {};
  }
  if (!fs::exists(path, error)) {
    notes.push_back(fmt::format("{} is not there: {}", name, lacks));
    return {};
  }
  auto table = LooseTable::read(path, numbers, texts);
  if (!table || table->rows() == 0) {
    notes.push_back(fmt::format("{} holds no rows: {}", name, lacks));
    return {};
  }
  if (table->damaged() > 0)
    notes.push_back(fmt::format("{}: {} line{} cut off or damaged and left out", name, table->damaged(),
                                table->damaged() == 1 ? " is" : "s are"));
  return std::move(*table);
}

Names stage_numbers() {
  Names out{"request", "frame", "tile", "requested_s", "latency_ms", "display_ms"};
  for (const auto& stage : kUpdateStages) out.emplace_back(stage.column);
  return out;
}

// Rows of earlier versions have no begin_s: their times count from the first frame of each viewer.
void place_frames(RunTables& t) {
  const auto& begin = t.frames->has("begin_s") ? t.frames->numbers("begin_s") : t.frames->numbers("t_s");
  if (!t.frames->has("begin_s"))
    t.notes.emplace_back("frames.csv has no begin_s: its frames may not line up with the other tables");
  double first = INFINITY, last = -INFINITY;
  for (const double s : begin)
    if (std::isfinite(s)) first = std::min(first, s), last = std::max(last, s);
  if (std::isfinite(first)) t.origin_s = first, t.end_s = last;
  for (const double s : begin) t.frame_s.push_back(s - t.origin_s);
}

void leave_out_beginning(RunTables& t, double skip_s) {
  const double from_s = t.origin_s + skip_s;
  for (auto& [table, column, least] : {std::tuple{&t.frames, t.frames->has("begin_s") ? "begin_s" : "t_s", from_s},
                                       {&t.updates, "requested_s", from_s},
                                       {&t.stages, "requested_s", from_s},
                                       {&t.tiles, "encode_end_s", from_s},
                                       {&t.quality, "t_s", skip_s}})
    if (*table) (*table)->leave_out_below(column, least);
  t.frame_s.clear();
}

// Without frames, the other tables give the run's begin and end.
void place_without_frames(RunTables& t) {
  double first = INFINITY, last = -INFINITY;
  const auto look = [&](const std::optional<LooseTable>& table, const char* column) {
    if (!table) return;
    for (const double s : table->numbers(column))
      if (std::isfinite(s)) first = std::min(first, s), last = std::max(last, s);
  };
  look(t.updates, "requested_s"), look(t.updates, "complete_s"), look(t.tiles, "encode_end_s");
  if (std::isfinite(first)) t.origin_s = first, t.end_s = last;
}

}  // namespace

Result<LooseTable> LooseTable::read(const std::string& path, const std::vector<std::string>& numbers,
                                    const std::vector<std::string>& texts) {
  const auto table = tools::CsvTable::read(
      path, {.rows = std::numeric_limits<size_t>::max(), .line_bytes = kLongestRow, .lenient = true});
  if (!table) return table.error();
  LooseTable out;
  out.rows_ = table->rows();
  out.damaged_ = table->damaged();
  out.header_ = table->header();
  const auto place = [&](const auto& names, auto& columns, const auto& nothing) {
    std::vector<std::pair<size_t, decltype(&columns.begin()->second)>> found;
    for (const auto& name : names) {
      auto& column = columns[name];
      column.resize(out.rows_, nothing);
      if (const auto at = table->find(name)) found.emplace_back(*at, &column);
    }
    return found;
  };
  const auto number_columns = place(numbers, out.numbers_, std::numeric_limits<double>::quiet_NaN());
  const auto text_columns = place(texts, out.texts_, std::string());
  for (size_t row = 0; row < out.rows_; ++row) {
    const auto fields = table->fields(row);
    for (const auto& [at, column] : number_columns) (*column)[row] = loose_number(fields[at]);
    // Cut first, then made valid: a character that is cut in two becomes one sign.
    for (const auto& [at, column] : text_columns) (*column)[row] = to_utf8(fields[at].substr(0, kLongestText));
  }
  return out;
}

bool LooseTable::has(std::string_view name) const {
  return std::find(header_.begin(), header_.end(), name) != header_.end();
}

const std::vector<double>& LooseTable::numbers(const std::string& name) const {
  const auto found = numbers_.find(name);
  CHECK(found != numbers_.end());
  return found->second;
}

const std::vector<std::string>& LooseTable::texts(const std::string& name) const {
  const auto found = texts_.find(name);
  CHECK(found != texts_.end());
  return found->second;
}

void LooseTable::leave_out_below(const std::string& column, double least) {
  const std::vector<double> by = numbers(column);
  const auto cut = [&](auto& values) {
    size_t kept = 0;
    for (size_t row = 0; row < by.size(); ++row)
      if (!(by[row] < least)) std::swap(values[kept++], values[row]);
    values.resize(kept);
    rows_ = kept;
  };
  for (auto& [name, values] : numbers_) cut(values);
  for (auto& [name, values] : texts_) cut(values);
}

double RunTables::still_s() const {
  double out = 0;
  for (size_t row = 0; row < drawn.size(); ++row)
    if (const double ms = frames->numbers("inter_frame_ms")[row]; !drawn[row] && ms > 0) out += ms / 1e3;
  return out;
}

std::vector<double> RunTables::of_drawn(const std::string& column) const {
  std::vector<double> out = frames->numbers(column);
  for (size_t row = 0; row < drawn.size(); ++row)
    if (!drawn[row] || (column == "inter_frame_ms" && !(out[row] > 0))) out[row] = NAN;  // a first frame has no delay
  return out;
}

bool lies_within(const std::string& directory, const std::string& name) {
  std::error_code error;
  const fs::path real = fs::canonical(fs::path(directory) / name, error);
  return error || real == (fs::canonical(directory, error) / name);
}

RunTables read_run_tables(const std::string& directory, const std::string& kind, double skip_s) {
  RunTables t;
  t.slices = kind == "volume";
  const Names viewer{"viewer"};
  t.frames =
      read(directory, "frames.csv", "no inter-frame delay, points, update age and map", kFrameNumbers, viewer, t.notes);
  t.updates = read(directory, "updates.csv", "no view updates and their latency", kUpdateNumbers, viewer, t.notes);
  t.tiles = read(directory, "tiles.csv", "no rates of generating and transfer", kTileNumbers, {"sampler"}, t.notes);
  t.stages = read(directory, "stages.csv", "no stages of a view update (records of earlier versions have none)",
                  stage_numbers(), viewer, t.notes);
  t.quality =
      read(directory, "quality.csv", "no holes and PSNR (the run had no --verify)", kQualityNumbers, {}, t.notes);
  if (!t.frames) {
    place_without_frames(t);
    return t;
  }
  place_frames(t);
  if (skip_s > 0) leave_out_beginning(t, skip_s), place_frames(t);
  for (const double still : t.frames->numbers("still")) t.drawn.push_back(!(still > 0));
  return t;
}

}  // namespace telesplat::launcher
