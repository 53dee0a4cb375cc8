#include "tools/telesplat/movie/contact_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "common/image/canvas.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

constexpr int kMargin = 12, kLine = 20, kCellWidth = 400;
constexpr uint32_t kPaper = 0x181818, kInk = 0xe8e8e8, kPale = 0xa0a0a0;
constexpr tools::CsvTable::Limits kEpochs{.rows = 1'000'000, .line_bytes = 1 << 18};
constexpr int kTextScale = 2, kSmallScale = 1;

// A number with four digits behind the point, anything else as it is.
std::string short_value(const std::string& text) {
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return text;
  return fmt::format("{:.4g}", value);
}

std::string cut(std::string text, int scale, int width) {
  const auto most = size_t(std::max(1, width / (image::kGlyphAdvance * scale)));
  if (text.size() > most) text = text.substr(0, most - 1) + "~";
  return text;
}

}  // namespace

EpochCaptions::EpochCaptions(const std::string& run_directory) {
  const std::string path = run_directory + "/epochs.csv";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return;
  const auto table = tools::CsvTable::read(path, kEpochs);
  if (!table) return;
  const auto epoch = table->find("epoch");
  if (!epoch) return;
  std::vector<size_t> differing;
  for (size_t c = 0; c < table->header().size(); ++c) {
    const std::string& name = table->header()[c];
    if (c == *epoch || name == "t_s" || name.starts_with("room.")) continue;
    if (table->rows() == 0 || !table->number(0, c)) continue;  // transfer functions and the like are no caption
    for (size_t row = 1; row < table->rows(); ++row)
      if (table->text(row, c) != table->text(0, c)) {
        differing.push_back(c);
        break;
      }
  }
  for (size_t row = 0; row < table->rows(); ++row) {
    const auto number = table->count(row, *epoch);
    if (!number) continue;
    std::string text;
    for (const size_t c : differing)
      text += fmt::format("{}{} {}", text.empty() ? "" : "  ", table->header()[c], short_value(table->text(row, c)));
    captions_.emplace_back(*number, std::move(text));
  }
}

std::string EpochCaptions::of(EpochId epoch) const {
  const auto found =
      std::find_if(captions_.begin(), captions_.end(), [&](const auto& c) { return c.first == epoch.value; });
  return found == captions_.end() ? std::string() : found->second;
}

void ContactSheet::add(const image::View& picture, const DisplayedFrame& frame) {
  const int width = std::min(kCellWidth, picture.width);
  const int height = std::clamp(int(std::lround(double(width) * picture.height / picture.width)), 1, picture.height);
  cells_.push_back({image::shrink(picture, width, height), fmt::format("{:.2f} s  frame {}", frame.t_s, frame.number),
                    epochs_.of(frame.epoch)});
}

Status ContactSheet::write(const std::string& path, const std::string& title) const {
  int width = 1, height = 1;
  bool parameters = false;
  for (const Cell& c : cells_) {
    width = std::max(width, c.picture.width), height = std::max(height, c.picture.height);
    parameters |= !c.parameters.empty();
  }
  width = std::max(width, 180);
  const int n = int(cells_.size());
  const int columns = std::max(1, int(std::ceil(std::sqrt(double(n) * height / width)))),
            rows = (n + columns - 1) / columns;
  const int across = width + kMargin, down = height + (parameters ? 2 : 1) * kLine + kMargin;
  image::Canvas sheet(kMargin + columns * across, 2 * kMargin + kLine + rows * down, kPaper);
  sheet.text(kMargin, kMargin, cut(title, kTextScale, columns * across), kInk, kTextScale);
  for (int i = 0; i < n; ++i) {
    const Cell& c = cells_[size_t(i)];
    const int x = kMargin + i % columns * across, y = kMargin + kLine + kMargin + i / columns * down;
    sheet.place(c.picture, x, y);
    sheet.text(x, y + height + 4, cut(c.caption, kTextScale, width), kInk, kTextScale);
    sheet.text(x, y + height + 4 + kLine, cut(c.parameters, kSmallScale, width), kPale, kSmallScale);
  }
  std::error_code error;
  const auto folder = std::filesystem::path(path).parent_path();
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  return image::write_png(path, sheet.view());
}

}  // namespace telesplat::launcher
