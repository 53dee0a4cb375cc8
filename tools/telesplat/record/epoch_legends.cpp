#include "tools/telesplat/record/epoch_legends.h"

#include "common/scene/legend.h"
#include "tools/telesplat/scene/epochs.h"

namespace telesplat::launcher {
Result<EpochLegends> EpochLegends::read(const std::string& run_directory) {
  EpochLegends out;
  std::map<std::string, std::string> told;
  std::shared_ptr<const image::Legend> legend;
  const Status s = read_epochs(run_directory, {"epoch"}, [&](uint64_t epoch, tools::CsvRow& row) {
    std::map<std::string, std::string> facts;
    for (const char* name : {scene::kColouringFact, "transfer"})
      if (std::string text = row.text(name); !text.empty()) facts[name] = std::move(text);
    if (facts != told) {
      const auto read = scene::legend_of(facts, row.numbers());
      legend = read ? std::make_shared<const image::Legend>(*read) : nullptr;
      told = std::move(facts);
    }
    if (legend) out.legends_[epoch] = legend;
    return ok_status();
  });
  if (!s) return s.error();
  return out;
}

const image::Legend* EpochLegends::at(EpochId epoch) const {
  const auto found = legends_.find(epoch.value);
  return found == legends_.end() ? nullptr : found->second.get();
}

}  // namespace telesplat::launcher
