#include "tools/telesplat/movie/epoch_captions.h"

#include <fmt/format.h>

#include <vector>

#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

constexpr tools::CsvTable::Limits kEpochs{.rows = 1'000'000, .line_bytes = 1 << 18};

// Columns of numbers that are not the same in all rows; transfer functions and the like are no caption.
std::vector<size_t> differing(const tools::CsvTable& table) {
  std::vector<size_t> out;
  for (size_t c = 0; c < table.header().size(); ++c) {
    const std::string& name = table.header()[c];
    if (name == "epoch" || name == "t_s" || name.starts_with("room.") || !table.number(0, c)) continue;
    for (size_t row = 1; row < table.rows(); ++row)
      if (table.text(row, c) != table.text(0, c)) {
        out.push_back(c);
        break;
      }
  }
  return out;
}

}  // namespace

std::map<uint64_t, std::string> epoch_captions(const std::string& run_directory) {
  std::map<uint64_t, std::string> out;
  const auto table = tools::CsvTable::read(run_directory + "/epochs.csv", kEpochs);
  if (!table || table->rows() == 0) return out;
  const auto epoch = table->find("epoch");
  if (!epoch) return out;
  const auto columns = differing(*table);
  for (size_t row = 0; row < table->rows(); ++row) {
    const auto number = table->count(row, *epoch);
    if (!number) continue;
    std::string& text = out[*number];
    for (const size_t c : columns)
      if (const auto value = table->number(row, c))
        text += fmt::format("{}{} {:.4g}", text.empty() ? "" : "  ", table->header()[c], *value);
  }
  return out;
}

}  // namespace telesplat::launcher
