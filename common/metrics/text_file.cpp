#include "common/metrics/text_file.h"

#include "common/core/utf8.h"

namespace telesplat::metrics {

bool TextFile::open(const std::string& path) {
  file_.reset(std::fopen(path.c_str(), "w"));
  return is_open();
}

void TextFile::write(std::string_view text) {
  if (!file_) return;
  if (!valid_utf8(text)) return write(to_utf8(text));
  std::fwrite(text.data(), 1, text.size(), file_.get());
}

void TextFile::flush() {
  if (file_) std::fflush(file_.get());
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string out;
  for (const std::string& cell : cells) (out += cell) += ',';
  if (!out.empty()) out.pop_back();
  return out + '\n';
}

std::string csv_quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out + '"';
}

}  // namespace telesplat::metrics
