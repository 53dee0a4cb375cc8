// Reads EPT: a folder with a tree of nodes; each has a file with some of the points. Source: "Entwine Point Tile",
// entwine.io.
#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "common/parallel/in_parallel.h"
#include "services/data/base/mapped_file.h"
#include "services/data/base/refusal.h"
#include "services/data/base/stored_type.h"
#include "services/data/cloud/bytes.h"
#include "services/data/cloud/point_rows.h"
#include "services/data/cloud/readers.h"

namespace telesplat::data {
namespace {

using Json = nlohmann::json;

std::string text(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}
double real(const Json& json, const char* key, double otherwise) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? found->get<double>() : otherwise;
}

struct Tree {
  Json about;
  std::string type;                       // that of the nodes' files
  std::vector<std::string> pages, nodes;  // files in the folder: those that name nodes, and those with points
};

// A node's name is a depth and three numbers: "2-1-0-3".
bool names_node(const std::string& key) {
  return !key.empty() && key.size() < 64 && key.find_first_not_of("0123456789-") == key.npos;
}

Tree tree_of(std::string_view content, const std::string& path) {
  constexpr std::pair<std::string_view, const char*> kTypes[] = {
      {"laszip", "laz"}, {"binary", "bin"}, {"zstandard", "zst"}};
  Tree out;
  out.about = Json::parse(content, nullptr, false);
  if (!out.about.is_object()) refuse("{}: is damaged: it is no JSON object", path);
  out.type = text(out.about, "dataType");
  const auto type =
      std::find_if(std::begin(kTypes), std::end(kTypes), [&](const auto& t) { return t.first == out.type; });
  if (type == std::end(kTypes))
    refuse("{}: is EPT with points of type '{}'; laszip, binary and zstandard are read", path, out.type.substr(0, 40));
  FolderCompanions folder(path);
  std::vector<std::string> pages{"0-0-0-0"};
  std::set<std::string> seen(pages.begin(), pages.end());
  for (size_t i = 0; i < pages.size(); ++i) {
    out.pages.push_back("ept-hierarchy/" + pages[i] + ".json");
    const Json page = Json::parse(need(folder.read(out.pages.back())), nullptr, false);
    if (!page.is_object()) refuse("{}: {} is damaged", path, out.pages.back());
    for (const auto& [key, count] : page.items()) {
      if (!names_node(key) || !count.is_number_integer())
        refuse("{}: {} is damaged: '{}' is no node", path, out.pages.back(), key.substr(0, 40));
      if (count.get<int64_t>() < 0 && seen.insert(key).second) pages.push_back(key);
      if (count.get<int64_t>() > 0) out.nodes.push_back("ept-data/" + key + "." + type->second);
    }
  }
  std::sort(out.nodes.begin(), out.nodes.end());
  out.nodes.erase(std::unique(out.nodes.begin(), out.nodes.end()), out.nodes.end());
  return out;
}

struct Dimension {
  std::string name;
  StoredType type = StoredType::kU8;
  size_t at = 0;
  double scale = 1, offset = 0;
};

// The numbers of a point in files that are not LAZ.
struct Schema {
  std::vector<Dimension> dimensions;
  std::vector<std::string> columns;
  size_t bytes = 0;
};

Schema schema_of(const Json& about, const std::string& path) {
  Schema out;
  const Json none, &list = about.contains("schema") ? about["schema"] : none;
  for (const Json& entry : list) {
    const std::string name = text(entry, "name"), type = text(entry, "type");
    const double bytes = real(entry, "size", 0);
    const bool floats = type == "float";
    if ((bytes != 4 && bytes != 8 && (floats || (bytes != 1 && bytes != 2))) || out.columns.size() == kMaxColumns)
      refuse("{}: dimension {} has type '{}' of {} bytes", path, name.substr(0, 40), type.substr(0, 40), bytes);
    const StoredType stored =
        floats ? (bytes == 4 ? StoredType::kF32 : StoredType::kF64) : whole_type(size_t(bytes), type == "signed");
    out.dimensions.push_back({name, stored, out.bytes, real(entry, "scale", 1), real(entry, "offset", 0)});
    out.columns.push_back(name);
    out.bytes += size_t(bytes);
  }
  if (out.bytes == 0) refuse("{}: its points have no dimensions", path);
  return out;
}

class BinaryPart final : public Part {
 public:
  BinaryPart(const Schema& schema, std::string_view content, bool packed, const std::string& name)
      : schema_(schema), content_(content) {
    if (packed) unpack(name);
    if (content_.size() % schema.bytes != 0)
      refuse("{}: is truncated: {} bytes are no points of {} bytes", name, content_.size(), schema.bytes);
  }
  const std::vector<std::string>& columns() const override { return schema_.columns; }
  uint64_t add(PointRows& rows) const override {
    std::vector<double> row(schema_.columns.size());
    for (size_t at = 0; at < content_.size(); at += schema_.bytes) {
      for (size_t i = 0; i < row.size(); ++i) {
        const Dimension& d = schema_.dimensions[i];
        const double value =
            with_type(d.type, [&](auto zero) { return double(number<decltype(zero)>(content_, at + d.at)); });
        row[i] = value * d.scale + d.offset;
      }
      rows.add(row);
    }
    return 0;
  }

 private:
  void unpack(const std::string& name) {
    constexpr size_t kMostGrowth = 1000;
    const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
    std::vector<char> block(ZSTD_DStreamOutSize());
    ZSTD_inBuffer in{content_.data(), content_.size(), 0};
    for (size_t left = 1; left != 0;) {
      ZSTD_outBuffer out{block.data(), block.size(), 0};
      left = ZSTD_decompressStream(context.get(), &out, &in);
      if (ZSTD_isError(left)) refuse("{}: is damaged: {}", name, ZSTD_getErrorName(left));
      if (left != 0 && out.pos == 0 && in.pos == in.size) refuse("{}: is truncated at {} bytes", name, in.size);
      unpacked_.append(block.data(), out.pos);
      if (unpacked_.size() > content_.size() * kMostGrowth)
        refuse("{}: is damaged: {} bytes become more than {}", name, content_.size(), content_.size() * kMostGrowth);
    }
    content_ = unpacked_;
  }

  const Schema& schema_;
  std::string_view content_;
  std::string unpacked_;
};

std::shared_ptr<const SquareCloud> read_tree(std::string_view content, const std::string& path,
                                             const ReadProgress& progress, const std::string& array) {
  constexpr size_t kTogether = 32;
  const Tree tree = tree_of(content, path);
  const Schema schema = tree.type == "laszip" ? Schema() : schema_of(tree.about, path);
  std::optional<PointRows> rows;
  std::vector<std::string> columns;
  uint64_t withheld = 0;
  for (size_t first = 0; first < tree.nodes.size(); first += kTogether) {
    if (progress) progress(double(first) / double(tree.nodes.size()));
    std::array<std::shared_ptr<const MappedFile>, kTogether> files;
    std::array<std::unique_ptr<const Part>, kTogether> parts;
    std::array<std::string, kTogether> names;
    in_parallel(size_t{0}, std::min(kTogether, tree.nodes.size() - first), [&](size_t i) {
      const std::string& name = names[i] = (std::filesystem::path(path).parent_path() / tree.nodes[first + i]).string();
      files[i] = need(MappedFile::open(name));
      if (tree.type == "laszip")
        parts[i] = decode_las(files[i]->text(), name);
      else
        parts[i] = std::make_unique<BinaryPart>(schema, files[i]->text(), tree.type == "zstandard", name);
    });
    for (size_t i = 0; i < kTogether && parts[i]; ++i) {
      if (!rows) rows.emplace(path, columns = parts[i]->columns(), array);
      if (parts[i]->columns() != columns) refuse("{}: points of {} have other numbers", path, tree.nodes[first + i]);
      withheld += parts[i]->add(*rows);
    }
  }
  if (!rows) refuse("{}: holds no points", path);
  if (withheld > 0) rows->add_note(fmt::format("{} points are left out: the file marks them as withheld", withheld));
  const Json none, &place = tree.about.contains("srs") ? tree.about["srs"] : none;
  return rows->finish(fmt::format("EPT points ({})", tree.type), 255, reference_of_wkt(text(place, "wkt")), true);
}

}  // namespace

std::vector<std::string> ept_files(std::string_view content, const std::string& path) {
  const auto tree = or_error([&] { return tree_of(content, path); });
  std::vector<std::string> out;
  if (!tree) return out;
  out = tree->pages;
  out.insert(out.end(), tree->nodes.begin(), tree->nodes.end());
  return out;
}

ReadCloud read_ept(std::string_view content, const std::string& path, const ReadProgress& progress,
                   const std::string& array) {
  return or_error([&] { return read_tree(content, path, progress, array); });
}

}  // namespace telesplat::data
