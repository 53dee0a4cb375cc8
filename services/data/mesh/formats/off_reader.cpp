// Reads OFF. Source: Geomview 1.9 manual, section "OFF Files" (http://www.geomview.org/docs/html/OFF.html).
#include <algorithm>
#include <cmath>

#include "services/data/base/polygons/polygon.h"
#include "services/data/base/raw_colours.h"
#include "services/data/base/refusal.h"
#include "services/data/base/text_scanner.h"
#include "services/data/mesh/formats/readers.h"

namespace telesplat::data {
namespace {

constexpr char kComment = '#';

class OffReader {
 public:
  OffReader(std::string_view content, const std::string& name, const ReadProgress& progress)
      : content_(content), name_(name), progress_(progress), scan_(content) {}

  Mesh read() {
    mesh_.format = "off";
    read_header();
    read_vertices();
    read_faces();
    set_colours();
    return std::move(mesh_);
  }

 private:
  template <class... Given>
  [[noreturn]] void bad(fmt::format_string<Given...> what, Given&&... given) const {
    refuse("{}:{}: {}", name_, scan_.line_number(), fmt::format(what, std::forward<Given>(given)...));
  }
  void tick(size_t done) {
    if ((done & 0xffff) == 0 && progress_) progress_(double(scan_.offset()) / double(content_.size()));
  }
  bool real(double& out) { return scan_.skip_space(kComment) && scan_.number(out); }
  bool integer(double& out) { return real(out) && out == std::floor(out); }
  bool reals(double (&out)[4]) { return real(out[0]) && real(out[1]) && real(out[2]); }

  // Reads OFF with prefixes, which may be missing; then the numbers of vertices, faces and edges.
  void read_header() {
    scan_.skip_space(kComment);
    if (TextScanner first = scan_; !(first.number(counts_[0]) && first.word().empty())) {
      std::string_view word = scan_.word();
      const std::string keyword(word.substr(0, 20));
      const auto skip = [&](std::string_view prefix) {
        if (!word.starts_with(prefix)) return false;
        word.remove_prefix(prefix.size());
        return true;
      };
      bool other = false;
      for (bool any = true; any;) {  // in any order: MeshLab writes CSTOFF
        any = false;
        for (const auto& [prefix, has] :
             {std::pair("ST", &texture_), {"C", &colours_}, {"N", &normals_}, {"4", &other}, {"n", &other}})
          if (skip(prefix)) any = *has = true;
      }
      if (other && word == "OFF") bad("{} has vertices of other than three coordinates, which are not shown", keyword);
      if (word != "OFF") bad("'{}' is not OFF, nor OFF with the prefixes ST, C, N", keyword);
      if (TextScanner after = scan_; after.skip_blanks(kComment) && after.word() == "BINARY")
        bad("is binary, which is not read: save it as text");
    }
    bool one_line = true;
    for (int i = 0; i < 3; ++i) {
      const bool goes_on = scan_.skip_blanks(kComment);
      if (i == 1) one_line = goes_on;
      if (i == 2 && one_line && !goes_on) break;  // some files leave out the number of edges
      if (!integer(counts_[i]) || counts_[i] < 0) bad("after OFF stand the numbers of vertices, faces and edges");
    }
    const size_t vertex_numbers = 3 + (normals_ ? 3 : 0);
    check_count("vertices", counts_[0], vertex_numbers);
    check_count("faces", counts_[1], 1);
    vertices_ = size_t(counts_[0]), faces_ = size_t(counts_[1]);
  }

  // Each number takes a digit and a separator; only the last needs no separator.
  void check_count(const char* what, double count, size_t numbers) const {
    const auto most = double((content_.size() + 1) / (2 * numbers));
    if (count <= most) return;
    bad("header claims {:.0f} {}, a file of {} bytes holds at most {:.0f}", count, what, content_.size(), most);
  }

  void read_vertices() {
    mesh_.positions.reserve(vertices_);
    for (size_t v = 0; v < vertices_; ++v, tick(v)) {
      double p[4], c[4];
      if (!reals(p)) bad("vertex {} of {} is missing or no number", v, vertices_);
      mesh_.positions.emplace_back(p[0], p[1], p[2]);
      if (normals_) {
        if (!reals(p)) bad("normal of vertex {} is missing or no number", v);
        mesh_.normals.emplace_back(p[0], p[1], p[2]);
      }
      if (colours_) {
        const int channels = numbers_to_line_end(c);
        if (channels < 3) bad("vertex {} has {} colour channels instead of 3 or 4", v, channels);
        vertex_colours_.add({c[0], c[1], c[2]});
      }
      if (texture_) scan_.next_line();
    }
  }

  // Reads up to four numbers; returns their count.
  int numbers_to_line_end(double (&out)[4]) {
    int n = 0;
    while (n < 4 && scan_.skip_blanks(kComment) && scan_.number(out[n])) ++n;
    return n;
  }

  void read_faces() {
    mesh_.indices.reserve(std::min(3 * faces_, content_.size() / 2));
    std::vector<uint32_t> ring;
    for (size_t f = 0; f < faces_; ++f, tick(f)) {
      double corners;
      if (!integer(corners) || corners < 0)
        bad("face {} of {} is missing or does not start with its number of corners", f, faces_);
      ring.clear();
      for (double i = 0; i < corners; ++i) {  // a false count ends with the file
        double index;
        if (!integer(index)) bad("face {} lacks corner {:.0f} of {:.0f}", f, i, corners);
        if (!(index >= 0 && index < double(vertices_)))
          bad("face {} names vertex {}, there are {}", f, index, vertices_);
        ring.push_back(uint32_t(index));
      }
      if (corners < 3) ++mesh_.degenerate_dropped;
      const size_t before = mesh_.indices.size() / 3;
      cut_polygon(ring, mesh_.positions, mesh_.indices);
      read_face_colour(before);
    }
  }

  // Reads a face's colour: nothing, one number (an index into Geomview's own colour map), or three or four channels:
  // integers up to 255 or fractions of 1.
  void read_face_colour(size_t first_triangle) {
    double c[4];
    const int count = numbers_to_line_end(c);
    scan_.next_line();
    by_map_ += count == 1;
    if (count < 3) return;
    uint32_t colour = kUndecided;  // 0 and 1 fit both ranges: other faces decide
    const double largest = std::max({c[0], c[1], c[2]});
    const auto channel = [](double v) { return v > 0 ? uint32_t(std::min(v + 0.5, 255.0)) : 0; };
    if (largest > 1)
      colour = pack_rgb(channel(c[0]), channel(c[1]), channel(c[2])), whole_numbers_ = true;
    else if (std::all_of(c, c + 3, [](double v) { return v == 0 || v == 1; }))
      colour |= pack_rgb(uint32_t(c[0]), uint32_t(c[1]), uint32_t(c[2]));
    else
      colour = pack_rgb(channel(255 * c[0]), channel(255 * c[1]), channel(255 * c[2]));
    face_colours_.resize(first_triangle, kNoColour);
    face_colours_.resize(mesh_.indices.size() / 3, colour);
  }

  void set_colours() {
    if (colours_) mesh_.colours = vertex_colours_.packed(kNeutralAlbedo);
    if (by_map_ > 0)
      mesh_.notes.push_back(fmt::format(
          "{}: {} faces name their colours in a colour map of Geomview's, which is not known", name_, by_map_));
    if (face_colours_.empty()) return;
    face_colours_.resize(mesh_.indices.size() / 3, kNoColour);
    for (uint32_t& c : face_colours_)
      if (c != kNoColour && c >= kUndecided) c = (c & 0x010101) * (whole_numbers_ ? 1 : 255);
    colour_faces(mesh_, face_colours_);
  }

  static constexpr uint32_t kUndecided = 0x01000000;

  std::string_view content_;
  const std::string& name_;
  const ReadProgress& progress_;
  TextScanner scan_;
  bool colours_ = false, normals_ = false, texture_ = false;
  double counts_[3] = {};
  size_t vertices_ = 0, faces_ = 0;
  Mesh mesh_;
  RawColours vertex_colours_;
  std::vector<uint32_t> face_colours_;  // empty, or one per triangle
  bool whole_numbers_ = false;
  size_t by_map_ = 0;
};

}  // namespace

Result<Mesh> read_off(std::string_view content, const std::string& name, const ReadProgress& progress) {
  return or_error([&] { return OffReader(content, name, progress).read(); });
}

}  // namespace telesplat::data
