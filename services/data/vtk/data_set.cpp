#include "services/data/vtk/data_set.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::data::vtk {

void Array::swap_bytes() {
  if (owned.empty()) owned.assign(data, data + values * stored_bytes(type)), data = owned.data();
  data::swap_bytes(owned, type);
}

std::vector<uint32_t> indices_of(const Array& array) {
  std::vector<uint32_t> out(array.values);
  with_type(array.type, [&](auto v) {
    for (size_t i = 0; i < out.size(); ++i) {
      std::memcpy(&v, array.data + i * sizeof v, sizeof v);
      out[i] = v >= decltype(v){0} && double(v) < 4294967295.0 ? uint32_t(v) : ~uint32_t{0};
    }
  });
  return out;
}

std::vector<uint8_t> types_of(const Array& array) {
  const auto indices = indices_of(array);
  std::vector<uint8_t> out(indices.size());
  for (size_t i = 0; i < out.size(); ++i) out[i] = uint8_t(std::min(indices[i], 255u));
  return out;
}

void append_cells(Cells cells, uint8_t type, DataSet& set) {
  set.types.resize(set.types.size() + cells.size(), type);
  if (set.cells.size() == 0) {
    set.cells = std::move(cells);
    return;
  }
  const size_t before = set.cells.points.size();
  set.cells.points.insert(set.cells.points.end(), cells.points.begin(), cells.points.end());
  for (size_t i = 1; i < cells.begins.size(); ++i) set.cells.begins.push_back(before + cells.begins[i]);
}

const Array* Attributes::find(std::string_view name) const {
  const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const Array& a) { return a.name == name; });
  return found == arrays.end() || name.empty() ? nullptr : &*found;
}

size_t DataSet::point_count() const {
  return structured ? size_t(side(0)) * size_t(side(1)) * size_t(side(2)) : points.tuples();
}

size_t DataSet::cell_count() const {
  if (!structured) return cells.size();
  size_t count = 1;
  for (size_t a = 0; a < 3; ++a) count *= size_t(std::max<int64_t>(side(a) - 1, 1));
  return count;
}

glm::dvec3 DataSet::point(size_t i) const {
  if (points.data) return {points.at(3 * i), points.at(3 * i + 1), points.at(3 * i + 2)};
  const size_t x = i % size_t(side(0)), y = i / size_t(side(0)) % size_t(side(1)), z = i / size_t(side(0) * side(1));
  if (!image) return {axes[0].at(x), axes[1].at(y), axes[2].at(z)};
  const glm::dvec3 index(double(extent[0]) + double(x), double(extent[2]) + double(y), double(extent[4]) + double(z));
  return index_to_data * glm::dvec4(index, 1);
}

void check_extent(const std::array<int64_t, 6>& extent, size_t file_bytes, const std::string& name) {
  double points = 1;
  for (size_t a = 0; a < 3; ++a) {
    const double side = double(extent[2 * a + 1]) - double(extent[2 * a]) + 1;
    if (side < 1) refuse("{}: its extent goes from {} to {}", name, extent[2 * a], extent[2 * a + 1]);
    points *= side;
  }
  const double most = std::min(4294967294.0, 1032.0 * double(file_bytes));  // deflate's best ratio
  if (points <= most) return;
  refuse("{}: claims {:.0f} points, limit {:.0f} in a file of {} bytes", name, points, most, file_bytes);
}

void check_ids(std::span<const uint32_t> ids, size_t points, const std::string& name) {
  const auto bad = std::find_if(ids.begin(), ids.end(), [&](uint32_t i) { return i >= points; });
  if (bad == ids.end()) return;
  if (*bad == ~uint32_t{0}) refuse("{}: a cell has a point number that is negative or too large", name);
  refuse("{}: a cell names point {} of {}", name, *bad, points);
}

void parse_numbers(TextScanner& in, size_t most, Array& out) {
  with_type(out.type, [&](auto v) {
    std::conditional_t<std::is_floating_point_v<decltype(v)>, double, int64_t> value{};
    while (out.values < most && in.skip_space() && in.value(value)) {
      v = static_cast<decltype(v)>(value);
      const auto* bytes = reinterpret_cast<const std::byte*>(&v);
      out.owned.insert(out.owned.end(), bytes, bytes + sizeof v);
      ++out.values;
    }
  });
  out.data = out.owned.data();
}

Cells make_cells(const Array& ids, const Array& ends, bool with_first, size_t points, const std::string& name) {
  Cells out;
  out.points = indices_of(ids);
  const auto offsets = indices_of(ends);
  const size_t first = with_first && !offsets.empty() ? 1 : 0;
  out.begins.reserve(offsets.size() + 1);
  for (size_t i = first; i < offsets.size(); ++i) {
    if (offsets[i] < out.begins.back() || offsets[i] > out.points.size())
      refuse("{}: cell {} ends at {} of {} point numbers, the one before at {}", name, i - first, offsets[i],
             out.points.size(), out.begins.back());
    out.begins.push_back(offsets[i]);
  }
  check_ids(out.points, points, name);
  return out;
}

Cells make_listed_cells(const Array& list, size_t count, const std::string& name) {
  Cells out;
  const auto words = indices_of(list);
  for (size_t at = 0; out.size() < count; at += words[at] + 1) {
    if (at >= words.size() || words[at] > words.size() - at - 1)
      refuse("{}: cell {} of {} goes beyond the {} numbers of all", name, out.size(), count, words.size());
    out.add(std::span(words).subspan(at + 1, words[at]));
  }
  return out;
}

void add_face_stream(std::span<const uint32_t> stream, DataSet& set) {
  size_t at = 1;
  for (uint32_t face = 0; stream.empty() || face < stream[0]; ++face) {
    if (at >= stream.size() || stream[at] > stream.size() - at - 1)
      refuse("{}: the faces of a polyhedron are cut off", set.name);
    set.faces.add(stream.subspan(at + 1, stream[at]));
    at += stream[at] + 1;
  }
}

}  // namespace telesplat::data::vtk
