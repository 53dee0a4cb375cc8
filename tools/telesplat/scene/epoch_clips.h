// What was cut away in a run's epochs: the column "clip" of epochs.csv.
#pragma once

#include <map>
#include <string>

#include "common/core/ids.h"
#include "common/geometry/clip.h"
#include "common/scene/clip_order.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {

class EpochClips {
 public:
  /// Of a row of the table, which is of this epoch. Error: names the row and what is wrong with it.
  Status read(const tools::CsvTable& table, size_t row, uint64_t epoch) {
    const auto column = table.find(scene::kClipFact);
    const std::string text = column ? table.text(row, *column) : std::string();
    if (text.empty()) return ok_status();
    auto clip = geometry::clip_from_text(text);
    if (!clip) return table.wrong(row, clip.error().text);
    clips_[epoch] = *std::move(clip);
    return ok_status();
  }
  /// Empty: nothing was cut away.
  geometry::Clip at(EpochId epoch) const {
    const auto found = clips_.find(epoch.value);
    return found == clips_.end() ? geometry::Clip() : found->second;
  }

 private:
  std::map<uint64_t, geometry::Clip> clips_;
};

}  // namespace telesplat::launcher
