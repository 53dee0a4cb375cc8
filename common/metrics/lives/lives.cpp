#include "common/metrics/lives/lives.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/metrics/columns.h"
#include "common/metrics/text_file.h"

namespace telesplat::metrics {
namespace {

constexpr const char* kFiles[kCsvs] = {"frames.csv", "updates.csv", "stages.csv",    "tiles.csv",
                                       "plans.csv",  "epochs.csv",  "assignment.csv"};
constexpr size_t kOwnColumns = 6;       // before those of the tables
constexpr uint64_t kTail = 4u << 20;    // no row is longer
constexpr size_t kMostLives = 100'000;  // of a file that is not ours

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

// The end of a file, and where it begins.
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
  // The last one may be cut off; each has a line.
  if (const size_t line = text.rfind('\n');
      line != text.npos && line + 1 < text.size() && !nlohmann::json::accept(std::string_view(text).substr(line + 1)))
    text.resize(line);
  cut(",");
  return begin + text.size() + (text.ends_with('[') ? 1 : 0);
}

}  // namespace telesplat::metrics
