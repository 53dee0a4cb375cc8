#include "services/master/record/lives.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <streambuf>
#include <string>

#include "common/metrics/columns.h"
#include "services/master/record/text_file.h"

namespace telesplat::metrics {

namespace {

constexpr const char* kFiles[kCsvs] = {"frames.csv", "updates.csv", "stages.csv",    "tiles.csv",
                                       "plans.csv",  "epochs.csv",  "assignment.csv"};
constexpr size_t kOwnColumns = 6;       // columns before those of the tables
constexpr uint64_t kTail = 4u << 20;    // bytes; no row is longer
constexpr size_t kMostLives = 100'000;  // a file with more is not ours

struct Row {
  size_t number;
  const Life& life;
  const Beginning& run;

  std::string bytes(Csv csv) const { return std::to_string(life.bytes[size_t(csv)]); }
};
constexpr Column<Row, std::string> kColumns[] = {
    {"life", [](const Row& r) { return std::to_string(r.number); }},
    {"begin_s", [](const Row& r) { return fmt::format("{:.9f}", r.life.begin.monotonic_s - r.run.monotonic_s); }},
    {"begin", [](const Row& r) { return r.life.begin.unix_ns ? iso_time(r.life.begin.unix_ns) : ""; }},
    {"monotonic_s", [](const Row& r) { return fmt::format("{:.9f}", r.life.begin.monotonic_s); }},
    {"unix_ns", [](const Row& r) { return std::to_string(r.life.begin.unix_ns); }},
    {"clock", [](const Row& r) { return csv_cell(r.life.clock); }},
    {"frames_bytes", [](const Row& r) { return r.bytes(Csv::kFrames); }},
    {"updates_bytes", [](const Row& r) { return r.bytes(Csv::kUpdates); }},
    {"stages_bytes", [](const Row& r) { return r.bytes(Csv::kStages); }},
    {"tiles_bytes", [](const Row& r) { return r.bytes(Csv::kTiles); }},
    {"plans_bytes", [](const Row& r) { return r.bytes(Csv::kPlans); }},
    {"epochs_bytes", [](const Row& r) { return r.bytes(Csv::kEpochs); }},
    {"assignment_bytes", [](const Row& r) { return r.bytes(Csv::kAssignment); }},
};
static_assert(std::size(kColumns) == kOwnColumns + kCsvs);

template <class T>
bool read(const std::string& text, T& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size();
}

// Reads the last kTail bytes of a file; begin: their place in it.
std::string tail_of(const std::string& path, uint64_t& begin) {
  std::error_code error;
  const uint64_t size = std::filesystem::file_size(path, error);
  if (error) return {};
  begin = size - std::min(size, kTail);
  std::ifstream in(path, std::ios::binary);
  in.seekg(std::streamoff(begin));
  std::string out(size - begin, '\0');
  in.read(out.data(), std::streamsize(out.size()));
  out.resize(size_t(std::max<std::streamsize>(in.gcount(), 0)));
  return out;
}

}  // namespace

const char* file_of(Csv csv) { return kFiles[size_t(csv)]; }

std::string lives_header() { return csv_line(names(kColumns)); }

std::string life_row(size_t number, const Life& life, const Beginning& run) {
  return csv_line(values(kColumns, Row{number, life, run}));
}

Result<std::vector<Life>> read_lives(const std::string& directory) {
  const std::string path = directory + "/" + kLivesFile;
  const auto wrong = [&](const char* what) { return Error{fmt::format("{}: {}", path, what)}; };
  uint64_t begin = 0;
  const std::string text = tail_of(path, begin);
  const std::string header = lives_header();
  if (begin != 0 || !text.starts_with(header)) return wrong("is not there, or tells no lives of a record");
  std::vector<Life> out;
  for (size_t at = header.size(), end = 0; (end = text.find('\n', at)) != text.npos; at = end + 1) {
    const auto cells = csv_cells(std::string_view(text).substr(at, end - at));
    Life life;
    bool ok = cells.size() == kOwnColumns + kCsvs && read(cells[3], life.begin.monotonic_s) &&
              read(cells[4], life.begin.unix_ns) && out.size() < kMostLives;
    for (size_t i = 0; ok && i < kCsvs; ++i) ok = read(cells[kOwnColumns + i], life.bytes[i]);
    if (!ok) return wrong("has a row that tells no life");
    life.clock = cells[5];
    out.push_back(std::move(life));
  }
  if (out.empty()) return wrong("tells no life");
  return out;
}

Beginning continued(const Life& first, const Life& now) {
  Beginning out = first.begin;
  if (first.clock == now.clock && !now.clock.empty() && first.begin.monotonic_s <= now.begin.monotonic_s) return out;
  out.monotonic_s = now.begin.monotonic_s - double(now.begin.unix_ns - first.begin.unix_ns) * 1e-9;
  return out;
}

uint64_t whole_rows(const std::string& path) {
  uint64_t begin = 0;
  const size_t end = tail_of(path, begin).rfind('\n');
  return end == std::string::npos ? 0 : begin + end + 1;
}

uint64_t whole_events(const std::string& path) {
  uint64_t begin = 0;
  std::string text = tail_of(path, begin);
  if (begin == 0 && !text.starts_with("[\n")) return 0;
  const auto cut = [&text](std::string_view end) {
    if (text.ends_with(end)) text.resize(text.size() - end.size());
  };
  cut("\n]\n");
  // Each event has a line; the last one may be cut off.
  if (const size_t line = text.rfind('\n');
      line != text.npos && line + 1 < text.size() && !nlohmann::json::accept(std::string_view(text).substr(line + 1)))
    text.resize(line);
  cut(",");
  return begin + text.size() + (text.ends_with('[') ? 1 : 0);
}

namespace {

using Cells = std::vector<std::string>;

double number(const std::string& cell, double none = 0) {
  char* end = nullptr;
  const double value = std::strtod(cell.c_str(), &end);
  return cell.empty() || *end != '\0' ? none : value;
}

constexpr size_t kMostOfLine = 1 << 16;  // a viewer's row of all columns has 2 KiB

/// Reads the next whole line, its first kMostOfLine bytes only. Returns its full size in bytes with its end; 0: no
/// whole line is left.
uint64_t take_line(std::istream& in, std::string& line) {
  line.clear();
  uint64_t bytes = 0;
  for (std::streambuf& buffer = *in.rdbuf();; ++bytes) {
    const int c = buffer.sbumpc();
    if (c == std::char_traits<char>::eof()) return 0;
    if (c == '\n') return bytes + 1;
    if (line.size() < kMostOfLine) line += char(c);
  }
}

/// Returns the column with the time when the thing in a row began; empty: the table is not filtered by time.
const char* began_in(Csv csv) {
  switch (csv) {
    case Csv::kFrames:
      return "begin_s";
    case Csv::kTiles:
      return "leased_s";
    case Csv::kPlans:
      return "asked_s";
    case Csv::kEpochs:
    case Csv::kAssignment:
      return "";
    case Csv::kUpdates:
    case Csv::kStages:
      break;
  }
  return "requested_s";
}

/// Reads the rows of a table one after the other. Leaves out rows that are cut off, too long or of another number of
/// cells.
class Rows {
 public:
  Rows(const std::string& directory, Csv csv, const std::vector<Life>& lives, double from_s)
      : in_(directory + "/" + file_of(csv)), csv_(csv), lives_(lives), from_s_(from_s) {
    std::string line;
    at_ = take_line(in_, line);
    if (at_ > 0) columns_ = csv_cells(line);
  }

  bool next() {
    std::string line;
    for (uint64_t bytes = take_line(in_, line); bytes > 0; bytes = take_line(in_, line)) {
      while (life_ < lives_.size() && at_ >= lives_[life_].bytes[size_t(csv_)]) ++life_;
      at_ += bytes;
      if (bytes > kMostOfLine) continue;
      cells_ = csv_cells(line);
      if (cells_.size() == columns_.size() && !(number_of(began_in(csv_)) < from_s_)) return true;
    }
    return false;
  }
  /// Number of the master that wrote the row, from 1.
  size_t life() const { return life_; }
  const Cells& columns() const { return columns_; }
  const Cells& cells() const { return cells_; }
  const std::string& of(const char* name) const {
    static const std::string none;
    const auto c = std::find(columns_.begin(), columns_.end(), name);
    return c == columns_.end() ? none : cells_[size_t(c - columns_.begin())];
  }
  double number_of(const char* name) const { return number(of(name)); }
  uint64_t whole(const char* name) const { return uint64_t(std::clamp(number_of(name), 0.0, 9007199254740992.0)); }

 private:
  std::ifstream in_;
  const Csv csv_;
  const std::vector<Life>& lives_;
  const double from_s_;
  Cells columns_, cells_;
  size_t life_ = 1;
  uint64_t at_ = 0;
};

// Reads a table of viewers, whose names come first. An empty cell did not happen: it is read as -1.
void read_table(Rows rows, const std::string& table, Measured& out) {
  if (rows.columns().size() < 2) return;
  wire::MetricRows one{{}, table, {rows.columns().begin() + 1, rows.columns().end()}, {}};
  while (rows.next()) {
    one.values.clear();
    for (const auto& cell : std::span(rows.cells()).subspan(1)) one.values.push_back(number(cell, -1));
    if (const Status added = out.add(rows.cells()[0], one); !added) return;
  }
}

wire::TileDone tile_of(const Rows& row) {
  wire::TileDone t;
  t.frame = {row.whole("frame")};
  t.samples = row.whole("samples");
  t.kept = row.whole("kept");
  t.bytes_sent = row.whole("bytes_sent");
  t.depth_error_m = row.number_of("depth_error_m");
  t.normal_error_deg = row.number_of("normal_error_deg");
  t.colour_error = row.number_of("colour_error");
  t.step = row.whole("step");
  t.rays = row.whole("rays");
  t.extra = row.whole("extra") != 0;
  t.moments.leased_s = row.number_of("leased_s");
  t.moments.sample_begin_s = row.number_of("sample_begin_s");
  t.moments.encode_end_s = row.number_of("encode_end_s");
  t.moments.receive_s = row.number_of("receive_s");
  t.moments.packed_s = row.number_of("packed_s");
  return t;
}

PlanRow plan_of(const Rows& row) {
  PlanRow p;
  const std::string& outcome = row.of("outcome");
  p.outcome = outcome == "tiles"   ? PlanRow::Outcome::kTiles
              : outcome == "empty" ? PlanRow::Outcome::kEmpty
              : outcome == "full"  ? PlanRow::Outcome::kFull
                                   : PlanRow::Outcome::kLate;
  p.asked.frame = {row.whole("frame")};
  p.asked.extra = row.whole("extra") != 0;
  p.asked.camera.width = int(std::min<uint64_t>(row.whole("rays_full"), 1u << 30));
  p.asked.camera.height = 1;
  p.asked_s = row.number_of("asked_s");
  p.planned_s = row.number_of("planned_s");
  if (!row.of("plan_ms").empty()) p.figures["plan_ms"] = row.number_of("plan_ms");
  return p;
}

// Adds tiles and plans: a frame's plan before its tiles.
void read_sampled(Rows tiles, Rows plans, Measured& out) {
  size_t life = 1;
  const auto reach = [&](size_t reached) {
    for (; life < reached; ++life) out.begin_life();
  };
  bool planned = plans.next();
  const auto take_plan = [&] {
    reach(plans.life());
    out.tiles().add(plan_of(plans));
    planned = plans.next();
  };
  while (tiles.next()) {
    while (planned && (plans.life() < tiles.life() ||
                       (plans.life() == tiles.life() && plans.whole("frame") <= tiles.whole("frame"))))
      take_plan();
    reach(tiles.life());
    out.tiles().add(tiles.of("sampler"), tile_of(tiles));
  }
  while (planned) take_plan();
}

}  // namespace

std::vector<std::string> header_of(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  const uint64_t bytes = take_line(in, line);
  return bytes > 0 && bytes <= kMostOfLine ? csv_cells(line) : Cells();
}

Measured read_back(const std::string& directory, const std::vector<Life>& lives, double from_s) {
  Measured out;
  const auto rows = [&](Csv csv) { return Rows(directory, csv, lives, from_s); };
  read_table(rows(Csv::kFrames), "frames", out);
  read_table(rows(Csv::kUpdates), "updates", out);
  read_table(rows(Csv::kStages), "stages", out);
  read_sampled(rows(Csv::kTiles), rows(Csv::kPlans), out);
  for (Rows epochs(directory, Csv::kEpochs, lives, -1e300); epochs.next();) out.add_epoch();
  return out;
}

}  // namespace telesplat::metrics
