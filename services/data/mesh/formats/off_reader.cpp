// OFF. Source: Geomview 1.9 manual, section "OFF Files" (http://www.geomview.org/docs/html/OFF.html).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "services/data/base/text_scanner.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {
namespace {

constexpr char kComment = '#';

class OffReader {
 public:
  OffReader(std::string_view content, const std::string& name, const ReadProgress& progress)
      : name_(name), progress_(progress), bytes_(content.size()), scan_(content) {}

  Result<Mesh> read() {
    mesh_.format = "off";
    if (auto status = read_header(); !status) return status.error();
    if (auto status = read_vertices(); !status) return status.error();
    if (auto status = read_faces(); !status) return status.error();
    return std::move(mesh_);
  }

 private:
  Error bad(const std::string& what) const { return Error{fmt::format("{}:{}: {}", name_, scan_.line_number(), what)}; }

  bool next_number(double& out) { return scan_.skip_space(kComment) && scan_.number(out); }

  Status read_header() {
    scan_.skip_space(kComment);
    std::string_view word = scan_.word();
    const std::string keyword(word.substr(0, 20));
    if (word.starts_with("ST")) texture_ = true, word.remove_prefix(2);
    if (word.starts_with("C")) colours_ = true, word.remove_prefix(1);
    if (word.starts_with("N")) normals_ = true, word.remove_prefix(1);
    if (word != "OFF") return bad(fmt::format("'{}' is not OFF, nor OFF with the prefixes ST, C, N", keyword));
    double counts[3];
    for (double& count : counts)
      if (!next_number(count) || count < 0 || count != std::floor(count))
        return bad("after OFF stand the numbers of vertices, faces and edges, in text (binary OFF is not read)");
    // Each number takes a digit and a separator, but for the last.
    const auto check = [&](const char* what, double count, size_t numbers) -> Status {
      const double most = static_cast<double>((bytes_ + 1) / (2 * numbers));
      if (count > most)
        return bad(
            fmt::format("header claims {:.0f} {}, a file of {} bytes holds at most {:.0f}", count, what, bytes_, most));
      return ok_status();
    };
    if (auto status = check("vertices", counts[0], 3); !status) return status;
    if (auto status = check("faces", counts[1], 1); !status) return status;
    vertices_ = static_cast<size_t>(counts[0]), faces_ = static_cast<size_t>(counts[1]);
    return ok_status();
  }

  Status read_vertices() {
    mesh_.positions.reserve(vertices_);
    std::vector<glm::dvec3> raw_colours;
    for (size_t v = 0; v < vertices_; ++v) {
      double p[3], n[3], c[4] = {};
      for (double& x : p)
        if (!next_number(x)) return bad(fmt::format("vertex {} of {} is missing or no number", v, vertices_));
      mesh_.positions.emplace_back(p[0], p[1], p[2]);
      if (normals_) {
        for (double& x : n)
          if (!next_number(x)) return bad(fmt::format("normal of vertex {} is missing or no number", v));
        mesh_.normals.emplace_back(n[0], n[1], n[2]);
      }
      if (colours_) {  // three or four numbers, to the line's end
        int channels = 0;
        while (channels < 4 && scan_.skip_blanks(kComment)) {
          if (!scan_.number(c[channels])) return bad(fmt::format("colour of vertex {} is no number", v));
          ++channels;
        }
        if (channels < 3) return bad(fmt::format("vertex {} has {} colour channels instead of 3 or 4", v, channels));
        raw_colours.emplace_back(c[0], c[1], c[2]);
      }
      if (texture_) scan_.next_line();
      if ((v & 0xffff) == 0 && progress_) progress_(static_cast<double>(scan_.offset()) / static_cast<double>(bytes_));
    }
    set_colours(raw_colours);
    return ok_status();
  }

  // Channels are fractions of 1 if none in the file is larger, else whole numbers to 255.
  void set_colours(const std::vector<glm::dvec3>& raw) {
    double largest = 0;
    for (const glm::dvec3& c : raw) largest = std::max({largest, c.x, c.y, c.z});
    const double scale = largest <= 1.0 ? 255.0 : 1.0;
    const auto channel = [scale](double v) {
      return v > 0 ? static_cast<uint32_t>(std::min(v * scale + 0.5, 255.0)) : 0;
    };
    mesh_.colours.reserve(raw.size());
    for (const glm::dvec3& c : raw) mesh_.colours.push_back(pack_rgb(channel(c.x), channel(c.y), channel(c.z)));
  }

  Status read_faces() {
    mesh_.indices.reserve(std::min(3 * faces_, bytes_ / 2));
    for (size_t f = 0; f < faces_; ++f) {
      double corners;
      if (!next_number(corners) || corners < 0 || corners != std::floor(corners))
        return bad(fmt::format("face {} of {} is missing or does not start with its number of corners", f, faces_));
      uint32_t first = 0, previous = 0;
      for (double i = 0; i < corners; ++i) {  // a lying number ends where the file ends
        double index;
        if (!next_number(index)) return bad(fmt::format("face {} lacks corner {:.0f} of {:.0f}", f, i, corners));
        if (!(index >= 0 && index < static_cast<double>(vertices_)))
          return bad(fmt::format("face {} names vertex {}, there are {}", f, index, vertices_));
        const auto corner = static_cast<uint32_t>(index);
        if (i == 0) first = corner;
        if (i >= 2) mesh_.indices.insert(mesh_.indices.end(), {first, previous, corner});
        previous = corner;
      }
      if (corners < 3) ++mesh_.degenerate_dropped;
      scan_.next_line();  // a face's own colour, if any, is not used
      if ((f & 0xffff) == 0 && progress_) progress_(static_cast<double>(scan_.offset()) / static_cast<double>(bytes_));
    }
    return ok_status();
  }

  const std::string& name_;
  const ReadProgress& progress_;
  size_t bytes_;
  TextScanner scan_;
  bool colours_ = false, normals_ = false, texture_ = false;
  size_t vertices_ = 0, faces_ = 0;
  Mesh mesh_;
};

}  // namespace

Result<Mesh> read_off(std::string_view content, const std::string& name, const ReadProgress& progress) {
  return OffReader(content, name, progress).read();
}

}  // namespace telesplat::data
