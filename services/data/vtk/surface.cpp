#include "services/data/vtk/cells.h"

#include <algorithm>
#include <bit>
#include <glm/geometric.hpp>

namespace telesplat::data::vtk {
namespace {

constexpr size_t kMostAtOnce = 32'000'000;  // faces that are sorted at a time: 640 MB

struct OuterFace {
  uint32_t cell, face;
  uint32_t data_cell;
  bool of_volume;
  int8_t inward = -1;  // -1: not known yet; 1: it looks into its cell
};

// A face by its corners: the three after the lowest one, or the next one and a hash of all.
struct Entry {
  uint32_t b, c, d, cell, face;
  bool same_face(const Entry& o) const { return b == o.b && c == o.c && d == o.d; }
  bool operator<(const Entry& o) const {
    if (b != o.b) return b < o.b;
    if (c != o.c) return c < o.c;
    if (d != o.d) return d < o.d;
    return cell != o.cell ? cell < o.cell : face < o.face;
  }
};

uint64_t mixed(uint64_t v) {  // splitmix64
  v = (v ^ v >> 30) * 0xbf58476d1ce4e5b9;
  v = (v ^ v >> 27) * 0x94d049bb133111eb;
  return v ^ v >> 31;
}

// Returns the lowest corner; ~0: the face has fewer than three.
uint32_t key_of(std::span<const uint32_t> face, std::vector<uint32_t>& sorted, Entry& out) {
  sorted.assign(face.begin(), face.end());
  for (size_t i = 1; i < sorted.size() && sorted.size() <= 8; ++i)
    for (size_t k = i; k > 0 && sorted[k] < sorted[k - 1]; --k) std::swap(sorted[k], sorted[k - 1]);
  if (sorted.size() > 8) std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  if (sorted.size() < 3) return ~uint32_t{0};
  out.b = sorted[1], out.c = sorted[2], out.d = sorted.size() > 3 ? sorted[3] : ~uint32_t{0};
  if (sorted.size() > 4) {
    uint64_t hash = sorted.size();
    for (const uint32_t v : sorted) hash = mixed(hash + v);
    out.c = uint32_t(hash), out.d = uint32_t(hash >> 32);
  }
  return sorted[0];
}

class OuterFaces {
 public:
  OuterFaces(const DataSet& set, CellReader& cells) : set_(set), cells_(cells) {}

  std::vector<OuterFace> find() {
    bool volumes = false;
    for (size_t i = 0; i < cells_.count() && !volumes; ++i) volumes = dimension(i) == 3;
    if (!volumes)
      for (size_t i = 0; i < cells_.count(); ++i) take_alone(i);
    else if (set_.structured)
      find_structured();
    else
      find_by_corners();
    std::sort(out_.begin(), out_.end(), [](const OuterFace& a, const OuterFace& b) {
      return a.cell != b.cell ? a.cell < b.cell : a.face < b.face;
    });
    return std::move(out_);
  }

 private:
  int dimension(size_t cell) const {
    const CellKind* kind = cells_.kind(cell);
    return kind ? kind->dimension : 0;
  }
  void take_alone(size_t cell) {
    if (dimension(cell) == 2 && cells_.state(cell) == CellState::kShown)
      out_.push_back({uint32_t(cell), 0, uint32_t(cell), false});
  }

  void find_structured() {
    const auto sides = cells_.sides();
    const size_t steps[3] = {1, sides[0], sides[0] * sides[1]};
    for (size_t cell = 0; cell < cells_.count(); ++cell) {
      if (cells_.state(cell) != CellState::kShown) continue;
      for (uint32_t face = 0; face < 6; ++face) {  // -x +x -y +y -z +z, the table's order
        const size_t axis = face / 2, at = cell / steps[axis] % sides[axis];
        const bool up = face % 2 == 1;
        if (at == (up ? sides[axis] - 1 : 0) ||
            cells_.state(up ? cell + steps[axis] : cell - steps[axis]) == CellState::kAbsent)
          out_.push_back({uint32_t(cell), face, uint32_t(cell), true});
      }
    }
  }

  // Calls f(lowest corner, entry) for each face of cells that are not absent.
  template <class F>
  void each_face(F&& f) {
    std::vector<uint32_t> sorted;
    Entry entry{};
    for (size_t cell = 0; cell < cells_.count(); ++cell) {
      if (cells_.state(cell) == CellState::kAbsent || cells_.type(cell) == kStrip) continue;
      const size_t faces = cells_.face_count(cell);
      for (size_t face = 0; face < faces; ++face) {
        entry.cell = uint32_t(cell), entry.face = uint32_t(face);
        const uint32_t lowest = key_of(cells_.face(cell, face).corners, sorted, entry);
        if (lowest != ~uint32_t{0}) f(lowest, entry);
      }
    }
  }

  // Finds outer faces: lists faces by their lowest corner; equal ones meet when each list is sorted.
  void find_by_corners() {
    std::vector<uint32_t> counts(set_.point_count(), 0);
    each_face([&](uint32_t lowest, const Entry&) { ++counts[lowest]; });
    std::vector<size_t> ends(counts.size());
    std::vector<Entry> entries;
    for (size_t first = 0, last; first < counts.size(); first = last) {
      size_t total = 0;
      for (last = first; last < counts.size() && (total == 0 || total + counts[last] <= kMostAtOnce); ++last)
        ends[last] = total, total += counts[last];
      entries.resize(total);
      each_face([&](uint32_t lowest, const Entry& entry) {
        if (lowest >= first && lowest < last) entries[ends[lowest]++] = entry;
      });
      for (size_t v = first, begin = 0; v < last; begin = ends[v++]) {
        const auto list = std::span(entries).subspan(begin, ends[v] - begin);
        std::sort(list.begin(), list.end());
        for (size_t i = 0, next; i < list.size(); i = next) {
          for (next = i + 1; next < list.size() && list[next].same_face(list[i]);) ++next;
          settle(list.subspan(i, next - i));
        }
      }
    }
    for (size_t cell = 0; cell < cells_.count(); ++cell)
      if (cells_.type(cell) == kStrip) take_alone(cell);
  }

  // Decides the visible part of cells that share one face.
  void settle(std::span<const Entry> same) {
    const Entry* volume = nullptr;
    const Entry* surface = nullptr;
    size_t volumes = 0;
    for (const Entry& e : same) {
      const bool of_volume = dimension(e.cell) == 3;
      volumes += of_volume;
      if (of_volume)
        volume = &e;
      else if (!surface && cells_.state(e.cell) == CellState::kShown)
        surface = &e;
    }
    if (volumes == 1 && cells_.state(volume->cell) == CellState::kShown)
      out_.push_back({volume->cell, volume->face, surface ? surface->cell : volume->cell, true});
    else if (volumes > 0 && surface)
      take_alone(surface->cell);
    else if (volumes == 0)
      for (const Entry& e : same) take_alone(e.cell);
  }

  const DataSet& set_;
  CellReader& cells_;
  std::vector<OuterFace> out_;
};

// A face by its corners' positions.
struct Placed {
  uint64_t sum = 0, product = 1;
  uint32_t set = 0;
  size_t face = 0;
  bool same_face(const Placed& o) const { return sum == o.sum && product == o.product; }
  bool operator<(const Placed& o) const {
    if (sum != o.sum) return sum < o.sum;
    if (product != o.product) return product < o.product;
    return set != o.set ? set < o.set : face < o.face;
  }
};

class Joint {
 public:
  Joint(std::span<const DataSet> sets, std::vector<CellReader>& cells, std::vector<std::vector<OuterFace>>& faces)
      : sets_(sets), cells_(cells), faces_(faces) {}

  // Removes faces that volume cells of two data sets share, and those that a surface cell covers.
  void join() {
    std::vector<Placed> placed;
    for (uint32_t s = 0; s < sets_.size(); ++s)
      for (size_t f = 0; f < faces_[s].size(); ++f) placed.push_back(place(s, f));
    std::sort(placed.begin(), placed.end());
    for (size_t i = 0, next; i < placed.size(); i = next) {
      for (next = i + 1; next < placed.size() && placed[next].same_face(placed[i]);) ++next;
      if (next - i > 1) settle(std::span(placed).subspan(i, next - i));
    }
    for (auto& faces : faces_) std::erase_if(faces, [](const OuterFace& f) { return f.data_cell == ~uint32_t{0}; });
  }

 private:
  OuterFace& at(const Placed& p) { return faces_[p.set][p.face]; }
  FacePoints points(const Placed& p) { return cells_[p.set].face(at(p).cell, at(p).face); }

  Placed place(uint32_t set, size_t face) {
    Placed out{0, 1, set, face};
    for (const uint32_t corner : points(out).corners) {
      const glm::dvec3 p = sets_[set].point(corner) + 0.0;  // -0 becomes 0
      const uint64_t hash = mixed(mixed(mixed(std::bit_cast<uint64_t>(p.x)) + std::bit_cast<uint64_t>(p.y)) +
                                  std::bit_cast<uint64_t>(p.z));
      out.sum += hash, out.product *= hash | 1;
    }
    return out;
  }

  void settle(std::span<const Placed> same) {
    const auto is_volume = [&](const Placed& p) { return at(p).of_volume; };
    const auto volume = std::find_if(same.begin(), same.end(), is_volume);
    if (volume == same.end()) return;
    const auto surface = std::find_if_not(same.begin(), same.end(), is_volume);
    if (surface != same.end()) {
      const glm::dvec3 own = cells_[surface->set].area_vector(points(*surface).corners);
      at(*surface).inward = glm::dot(own, outward(*volume)) < 0;
    }
    // Volume cells on both sides hide the face; those on one side are copies of one cell in several pieces.
    const auto other = std::find_if(volume + 1, same.end(), is_volume);
    const bool repeated = other != same.end() && glm::dot(outward(*volume), outward(*other)) > 0;
    const auto kept = surface != same.end() || !repeated ? surface : volume;
    for (auto p = same.begin(); p != same.end(); ++p)
      if (p != kept) at(*p).data_cell = ~uint32_t{0};
  }

  glm::dvec3 outward(const Placed& p) {
    const glm::dvec3 own = cells_[p.set].area_vector(points(p).corners);
    return cells_[p.set].looks_inward(at(p).cell, at(p).face) ? -own : own;
  }

  std::span<const DataSet> sets_;
  std::vector<CellReader>& cells_;
  std::vector<std::vector<OuterFace>>& faces_;
};

Surface cut(const DataSet& set, CellReader& cells, std::span<const OuterFace> faces) {
  Surface out;
  FaceCutter cutter(set);
  for (const OuterFace& f : faces) {
    const size_t begin = out.corners.size();
    const FacePoints points = cells.face(f.cell, f.face);
    if (cells.type(f.cell) == kStrip) {
      const auto& c = points.corners;
      for (size_t k = 2; k < c.size(); ++k)
        out.corners.insert(out.corners.end(), {c[k - 2], c[k % 2 == 1 ? k : k - 1], c[k % 2 == 1 ? k - 1 : k]});
    } else if (points.corners.size() > 2) {
      cutter.cut(points, out.corners);
    }
    if (f.inward > 0 || (f.inward < 0 && f.of_volume && cells.looks_inward(f.cell, f.face)))
      for (size_t i = begin; i < out.corners.size(); i += 3) std::swap(out.corners[i + 1], out.corners[i + 2]);
    out.cells.resize(out.corners.size() / 3, f.data_cell);
  }
  return out;
}

void note(const CellReader& cells, SurfaceNotes& notes) {
  for (size_t i = 0; i < cells.count(); ++i) {
    const CellKind* kind = cells.kind(i);
    notes.unknown += !kind;
    notes.ghosts += cells.state(i) != CellState::kShown;
    notes.points_and_lines += kind && kind->dimension < 2;
    notes.straightened += kind && kind->corners_alone;
  }
}

}  // namespace

std::vector<Surface> surfaces_of(std::span<const DataSet> sets, SurfaceNotes& notes) {
  std::vector<CellReader> cells;
  std::vector<std::vector<OuterFace>> faces;
  bool volumes = false;
  for (const DataSet& set : sets) {
    if (set.cell_count() >= ~uint32_t{0})
      refuse("{}: has {} cells, limit {}", set.name, set.cell_count(), ~uint32_t{0} - 1);
    cells.emplace_back(set);
    cells.back().check();
    note(cells.back(), notes);
    faces.push_back(OuterFaces(set, cells.back()).find());
    for (const OuterFace& f : faces.back()) volumes = volumes || f.of_volume;
  }
  if (volumes && sets.size() > 1) Joint(sets, cells, faces).join();
  std::vector<Surface> out;
  for (size_t s = 0; s < sets.size(); ++s) out.push_back(cut(sets[s], cells[s], faces[s]));
  return out;
}

}  // namespace telesplat::data::vtk
