#include "services/data/mesh/formats/obj_materials.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "services/data/base/mesh.h"
#include "services/data/base/text_scanner.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxLibraries = 64, kMaxMaterials = 100'000;

std::string beside(const std::string& path, std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');  // backslashes of Windows programs
  return (std::filesystem::path(path).parent_path() / name).string();
}

uint32_t colour_of(const std::array<double, 3>& c) {
  const auto channel = [](double v) { return v > 0 ? static_cast<uint32_t>(std::min(v * 255 + 0.5, 255.0)) : 0; };
  return pack_rgb(channel(c[0]), channel(c[1]), channel(c[2]));
}

// Reads up to three numbers; returns their count.
int take_numbers(TextScanner& scan, double (&out)[3]) {
  int n = 0;
  while (n < 3 && scan.skip_blanks() && scan.number(out[n])) ++n;
  return n;
}

// Reads -s u v w, -o u v w, -clamp on, and other options; then the file's name, which may contain blanks.
void read_map(TextScanner& scan, std::string_view content, const std::string& library, ObjMaterial& material) {
  while (scan.skip_blanks()) {
    const size_t begin = scan.offset();
    const std::string_view word = scan.word();
    double numbers[3] = {};
    if (word == "-s" || word == "-o" || word == "-t") {
      const int n = take_numbers(scan, numbers);
      glm::vec2& to = word == "-s" ? material.scale : material.offset;
      if (n > 0 && word != "-t") to = {float(numbers[0]), float(n > 1 ? numbers[1] : (word == "-s" ? 1.0 : 0.0))};
      if (word == "-t" && (numbers[0] != 0 || numbers[1] != 0 || numbers[2] != 0)) material.not_applied = word;
    } else if (word == "-mm" || word == "-bm" || word == "-boost" || word == "-texres") {
      const int n = take_numbers(scan, numbers);
      if (word == "-mm" && n > 0 && (numbers[0] != 0 || (n > 1 && numbers[1] != 1))) material.not_applied = word;
    } else if (word == "-clamp" || word == "-blendu" || word == "-blendv" || word == "-cc" || word == "-imfchan" ||
               word == "-type") {
      scan.skip_blanks();
      const std::string_view value = scan.word();
      if (word == "-clamp") material.clamp = value == "on";
      if (word == "-cc" && value == "on") material.not_applied = word;
    } else {
      if (const std::string name = rest_of_line(content, begin); !name.empty())
        material.texture = beside(library, name);
      return;
    }
  }
}

void read_library(const std::string& path, std::string_view content, std::map<std::string, ObjMaterial>& materials) {
  TextScanner scan(content);
  ObjMaterial* material = nullptr;
  for (; scan.skip_space('#') && materials.size() < kMaxMaterials; scan.next_line()) {
    const std::string_view word = scan.word();
    double c[3];
    if (word == "newmtl") {
      material = &(materials[rest_of_line(content, scan.offset())] = {});
    } else if (material && word == "Kd") {
      if (take_numbers(scan, c) == 3) material->colour = colour_of({c[0], c[1], c[2]});
    } else if (material && word == "map_Kd") {
      read_map(scan, content, path, *material);
    }
  }
}

}  // namespace

std::vector<std::string> obj_material_libraries(std::string_view content, Companions& companions) {
  std::vector<std::string> out;
  constexpr std::string_view kWord = "mtllib", kBlanks = " \t";
  for (size_t at = content.find(kWord); at != content.npos && out.size() < kMaxLibraries;
       at = content.find(kWord, at)) {
    const size_t before = content.substr(0, at).find_last_not_of(kBlanks);
    const bool starts_line = before == content.npos || content[before] == '\n';
    at += kWord.size();
    if (!starts_line) continue;
    const std::string names = beside("", rest_of_line(content, at));
    if (names.empty()) continue;
    if (names.find_first_of(kBlanks) == names.npos || companions.read(names)) {
      out.push_back(names);
    } else {
      TextScanner scan(names);
      while (scan.skip_blanks() && out.size() < kMaxLibraries) out.emplace_back(scan.word());
    }
  }
  return out;
}

std::map<std::string, ObjMaterial> read_obj_materials(const std::vector<std::string>& libraries, Companions& companions,
                                                      std::vector<std::string>& missing) {
  std::map<std::string, ObjMaterial> out;
  for (const std::string& library : libraries) {
    if (const auto content = companions.read(library))
      read_library(library, *content, out);
    else
      missing.push_back(library);
  }
  return out;
}

}  // namespace telesplat::data
