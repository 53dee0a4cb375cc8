#include "tools/telesplat/scene/epochs.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/scene/clip_order.h"

namespace telesplat::launcher {
namespace {

// Escaped quotes may double the length of a transfer function or colouring, and numbers stand beside it.
constexpr tools::CsvTable::Limits kEpochs{.rows = 1'000'000, .line_bytes = 1 << 18};

}  // namespace

Error no_epoch(const std::string& run_directory, EpochId epoch, uint64_t first, uint64_t last) {
  return {fmt::format("{}/epochs.csv: has no epoch {}; it holds {} to {}", run_directory, epoch.value, first, last)};
}

Status read_epochs(const std::string& run_directory, const std::vector<const char*>& columns,
                   const std::function<Status(uint64_t, tools::CsvRow&)>& read) {
  const std::string path = run_directory + "/epochs.csv";
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return ok_status();
  const auto table = tools::CsvTable::read(path, kEpochs);
  if (!table) return table.error();
  for (const char* column : columns)
    if (const auto found = table->column(column); !found) return found.error();
  for (size_t i = 0; i < table->rows(); ++i) {
    tools::CsvRow row(*table, i);
    const uint64_t epoch = row.count("epoch");
    if (!row.status()) return row.status();
    if (const Status s = read(epoch, row); !s) return s;
    if (!row.status()) return row.status();
  }
  return ok_status();
}

void read_clip(uint64_t epoch, tools::CsvRow& row, std::map<uint64_t, geometry::Clip>& clips) {
  const std::string text = row.text(scene::kClipFact);
  if (text.empty()) return;
  auto clip = geometry::clip_from_text(text);
  if (clip)
    clips[epoch] = *std::move(clip);
  else
    row.demand(false, clip.error().text);
}

}  // namespace telesplat::launcher
