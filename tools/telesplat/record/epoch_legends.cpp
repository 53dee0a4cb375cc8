#include "tools/telesplat/record/epoch_legends.h"

#include <filesystem>

#include "common/scene/legend.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

constexpr tools::CsvTable::Limits kEpochs{.rows = 1'000'000, .line_bytes = 1 << 18};
constexpr const char* kTexts[] = {scene::kColouringFact, "transfer"};

}  // namespace

Result<EpochLegends> EpochLegends::read(const std::string& run_directory) {
  EpochLegends out;
  const std::string path = run_directory + "/epochs.csv";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return out;
  const auto table = tools::CsvTable::read(path, kEpochs);
  if (!table) return table.error();
  const auto epoch = table->column("epoch");
  if (!epoch) return epoch.error();
  std::map<std::string, size_t> texts;
  for (const char* name : kTexts)
    if (const auto column = table->find(name)) texts[name] = *column;
  if (texts.empty()) return out;

  std::map<std::string, std::string> told;
  std::shared_ptr<const image::Legend> legend;
  for (size_t row = 0; row < table->rows(); ++row) {
    const auto number = table->count(row, *epoch);
    if (!number) return number.error();
    std::map<std::string, std::string> facts;
    for (const auto& [name, column] : texts)
      if (std::string text = table->text(row, column); !text.empty()) facts[name] = std::move(text);
    if (facts != told) {
      std::map<std::string, double> parameters;
      for (size_t c = 0; c < table->header().size(); ++c)
        if (const auto value = table->number(row, c)) parameters[table->header()[c]] = *value;
      const auto read = scene::legend_of(facts, parameters);
      legend = read ? std::make_shared<const image::Legend>(*read) : nullptr;
      told = std::move(facts);
    }
    if (legend) out.legends_[*number] = legend;
  }
  return out;
}

const image::Legend* EpochLegends::at(EpochId epoch) const {
  const auto found = legends_.find(epoch.value);
  return found == legends_.end() ? nullptr : found->second.get();
}

}  // namespace telesplat::launcher
