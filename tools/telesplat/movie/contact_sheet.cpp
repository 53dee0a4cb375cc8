#include "tools/telesplat/movie/contact_sheet.h"

#include <algorithm>
#include <cmath>

namespace telesplat::launcher {
namespace {

constexpr uint32_t kPaper = 0x101214, kInk = 0xe8e8e8, kFaint = 0x9aa4ae;
constexpr int kGap = 8, kTextScale = 2, kLine = image::kGlyphHeight * kTextScale + 8;

int widest(const std::vector<std::string>& lines) {
  int out = 0;
  for (const auto& l : lines) out = std::max(out, image::text_width(l, kTextScale));
  return out;
}

int width_of(const SheetCell& cell) {
  int out = -kGap;
  for (const auto& p : cell.pictures) out += p.width + kGap;
  return std::max(out, widest(cell.texts));
}

int picture_height(const SheetRow& row) {
  int out = 0;
  for (const auto& cell : row.cells)
    for (const auto& p : cell.pictures) out = std::max(out, p.height);
  return out;
}

int height_of(const SheetRow& row) {
  size_t lines = row.label.empty() ? 0 : 1, below = 0;
  for (const auto& cell : row.cells) below = std::max(below, cell.texts.size());
  return picture_height(row) + int(lines + below) * kLine + 2 * kGap;
}

}  // namespace

image::View small_picture(const image::View& picture, int width) {
  const int w = std::min(width, picture.width);
  return image::shrink(picture, w,
                       std::clamp(int(std::lround(double(w) * picture.height / picture.width)), 1, picture.height));
}

image::View contact_sheet(const std::vector<std::string>& captions, const std::vector<SheetRow>& rows) {
  const int top = 2 * kGap + int(captions.size()) * kLine;
  std::vector<int> columns;
  int width = widest(captions), height = top;
  for (const auto& row : rows) {
    columns.resize(std::max(columns.size(), row.cells.size()));
    for (size_t i = 0; i < row.cells.size(); ++i) columns[i] = std::max(columns[i], width_of(row.cells[i]));
    width = std::max(width, image::text_width(row.label, kTextScale));
    height += height_of(row);
  }
  int all = 0;
  for (const int column : columns) all += column + 2 * kGap;
  image::Canvas canvas(std::max(width, all) + 2 * kGap, height, kPaper);
  for (size_t i = 0; i < captions.size(); ++i) canvas.text(kGap, kGap + int(i) * kLine, captions[i], kFaint);
  int y = top;
  for (const auto& row : rows) {
    canvas.text(kGap, y, row.label, kInk);
    const int pictures = y + (row.label.empty() ? 0 : kLine), texts = pictures + picture_height(row) + 4;
    int left = kGap;
    for (size_t i = 0; i < row.cells.size(); left += columns[i++] + 2 * kGap) {
      int x = left;
      for (const auto& p : row.cells[i].pictures) {
        canvas.place(p, x, pictures);
        x += p.width + kGap;
      }
      for (size_t l = 0; l < row.cells[i].texts.size(); ++l)
        canvas.text(left, texts + int(l) * kLine, row.cells[i].texts[l], kFaint);
    }
    y += height_of(row);
  }
  return canvas.view();
}

}  // namespace telesplat::launcher
