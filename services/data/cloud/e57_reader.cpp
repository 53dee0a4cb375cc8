// Reads E57: scans in pages with check sums; an XML text says what they hold. Sources: ASTM E2807-11; D. Huber, "The
// ASTM E57 File Format for 3D Imaging Data Exchange", SPIE 7864A, 2011.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <pugixml.hpp>

#include "common/parallel/in_parallel.h"
#include "services/data/base/refusal.h"
#include "services/data/cloud/bytes.h"
#include "services/data/cloud/point_rows.h"
#include "services/data/cloud/readers.h"

namespace telesplat::data {
namespace {

constexpr size_t kPage = 1024, kPayload = kPage - 4, kHeader = 48, kSectionHeader = 32;

// The check sum CRC-32C.
uint32_t crc32c(std::string_view bytes) {
  static const auto kTable = [] {
    std::array<uint32_t, 256> table;
    for (uint32_t i = 0; i < 256; ++i) {
      table[i] = i;
      for (int bit = 0; bit < 8; ++bit) table[i] = table[i] >> 1 ^ (table[i] & 1 ? 0x82f63b78 : 0);
    }
    return table;
  }();
  uint32_t sum = ~uint32_t{0};
  for (const char c : bytes) sum = sum >> 8 ^ kTable[(sum ^ uint8_t(c)) & 255];
  return ~sum;
}

// A number of each point.
struct Field {
  std::string name;
  bool real = false, coordinate = false;
  uint32_t bits = 0;
  int64_t least = 0;
  double scale = 1, offset = 0;
  int column = -1;  // among the rows'
  bool read = false;
  std::string stream;  // that of all points
};

// Finds a field by its name in the standard; returns the column's name. Empty: the field is no column.
std::string column_of(std::string_view name) {
  constexpr std::pair<std::string_view, const char*> kNames[] = {
      {"cartesianX", "x"},     {"cartesianY", "y"},       {"cartesianZ", "z"},
      {"sphericalRange", "x"}, {"sphericalAzimuth", "y"}, {"sphericalElevation", "z"},
      {"colorRed", "red"},     {"colorGreen", "green"},   {"colorBlue", "blue"}};
  for (const auto& [theirs, ours] : kNames)
    if (name == theirs) return ours;
  return name.find("Invalid") != name.npos ? "" : std::string(name);
}

struct Scan {
  uint64_t at = 0, count = 0;
  std::vector<Field> fields;
  bool spherical = false;
  std::optional<size_t> invalid;  // the field that says which points have no place
  glm::dquat rotation{1, 0, 0, 0};
  glm::dvec3 place{std::numeric_limits<double>::quiet_NaN()};  // the scanner's, if it is known
};

class E57Reader {
 public:
  E57Reader(std::string_view content, const std::string& name) : content_(content), name_(name) {}

  std::shared_ptr<const SquareCloud> read(const ReadProgress& progress, const std::string& array, uint64_t most) {
    read_text();
    PointRows rows(name_, columns_, array);
    uint64_t count = 0, invalid = 0;
    for (const Scan& scan : scans_) count += std::min(scan.count, kMaxPoints + 1);
    const uint64_t step = count > most ? (count + most - 1) / most : 1;
    for (size_t s = 0; s < scans_.size(); ++s) {
      if (progress) progress(double(s) / double(scans_.size()));
      read_streams(scans_[s]);
      rows.begin_scan(scans_[s].place);
      invalid += add_points(scans_[s], step, rows);
      scans_[s].fields.clear();
    }
    if (step > 1) rows.set_frame(box_);
    if (count > kMaxPoints) rows.add_note(fmt::format("only every {}th of its {} points is read", step, count));
    if (invalid > 0) rows.add_note(fmt::format("{} points are left out: the scanner measured none there", invalid));
    if (pictures_ > 0) rows.add_note(fmt::format("its {} pictures are left out", pictures_));
    return rows.finish(fmt::format("E57 points ({} scan{})", scans_.size(), scans_.size() == 1 ? "" : "s"),
                       real_colours_ ? 1 : 255, reference_, true);
  }

 private:
  // Returns bytes without the pages' check sums, from a place in the file.
  std::string bytes_at(uint64_t at, uint64_t size, const char* what) const {
    const uint64_t first = at / kPage, within = at % kPage, pages = content_.size() / kPage;
    if (first >= pages || within >= kPayload || size > (pages - first) * kPayload - within)
      refuse("{}: is truncated: {} of {} bytes lies at byte {} of {}", name_, what, size, at, content_.size());
    std::string out((within + size + kPayload - 1) / kPayload * kPayload, '\0');
    std::atomic<uint64_t> damaged{pages};
    in_parallel(uint64_t{0}, uint64_t{out.size() / kPayload}, [&](uint64_t i) {
      const std::string_view page = content_.substr((first + i) * kPage, kPage);
      if (__builtin_bswap32(number<uint32_t>(page, kPayload)) != crc32c(page.substr(0, kPayload))) damaged = first + i;
      page.copy(out.data() + i * kPayload, kPayload);
    });
    if (damaged < pages) refuse("{}: is damaged: the check sum of page {} of {} is wrong", name_, damaged + 0, pages);
    out.erase(0, within);
    out.resize(size);
    return out;
  }

  void read_text() {
    if (!content_.starts_with("ASTM-E57")) refuse("{}: is no E57 file: it does not begin with ASTM-E57", name_);
    if (content_.size() < kHeader) refuse("{}: is truncated: an E57 header has {} bytes", name_, kHeader);
    const auto major = number<uint32_t>(content_, 8);
    const auto page = number<uint64_t>(content_, 40);
    if (major != 1 || page != kPage)
      refuse("{}: is E57 {} with pages of {} bytes; 1 with {} is read", name_, major, page, kPage);
    const std::string text = bytes_at(number<uint64_t>(content_, 24), number<uint64_t>(content_, 32), "its XML text");
    pugi::xml_document document;
    if (const auto parsed = document.load_buffer(text.data(), text.size()); !parsed)
      refuse("{}: is damaged: its XML text: {}", name_, parsed.description());
    const pugi::xml_node root = document.child("e57Root");
    reference_ = reference_of_wkt(root.child("coordinateMetadata").child_value());
    for (const pugi::xml_node& picture : root.child("images2D").children())
      pictures_ += picture.type() == pugi::node_element;
    for (const pugi::xml_node& scan : root.child("data3D").children())
      if (scan.child("points")) scans_.push_back(scan_of(scan));
    if (scans_.empty()) refuse("{}: holds no points", name_);
  }

  Scan scan_of(const pugi::xml_node& node) {
    Scan scan;
    const pugi::xml_node points = node.child("points"), pose = node.child("pose");
    scan.at = points.attribute("fileOffset").as_ullong(), scan.count = points.attribute("recordCount").as_ullong();
    const auto value = [](const pugi::xml_node& of, const char* key) { return of.child(key).text().as_double(); };
    if (pose) {
      const pugi::xml_node r = pose.child("rotation"), t = pose.child("translation");
      if (r) scan.rotation = glm::dquat(value(r, "w"), value(r, "x"), value(r, "y"), value(r, "z"));
      const double length = glm::length(scan.rotation);
      if (!(length > 0 && std::isfinite(length))) refuse("{}: a scan's rotation has the length {}", name_, length);
      scan.rotation /= length;
      scan.place = {value(t, "x"), value(t, "y"), value(t, "z")};
    }
    for (const pugi::xml_node& codec : points.child("codecs").children())
      if (codec.type() == pugi::node_element && !codec.child("bitPackCodec"))
        refuse("{}: is E57 with a codec other than bitPackCodec, which is not read", name_);
    const bool cartesian = points.child("prototype").child("cartesianX");
    scan.spherical = !cartesian;
    for (const pugi::xml_node& child : points.child("prototype").children())
      if (child.type() == pugi::node_element) scan.fields.push_back(field_of(child, cartesian, scan));
    uint32_t bits = 0;
    for (const Field& field : scan.fields) bits += field.coordinate ? field.bits : 0;
    if (bits == 0) refuse("{}: its points lack x, y or z, or lie at one place", name_);
    return scan;
  }

  Field field_of(const pugi::xml_node& node, bool cartesian, Scan& scan) {
    Field field;
    field.name = node.name();
    const std::string_view type = node.attribute("type").value();
    field.real = type == "Float";
    if (field.real) {
      field.bits = node.attribute("precision").value() == std::string_view("single") ? 32 : 64;
    } else if (type == "Integer" || type == "ScaledInteger") {
      field.least = node.attribute("minimum").as_llong(std::numeric_limits<int64_t>::min());
      const int64_t most = node.attribute("maximum").as_llong(std::numeric_limits<int64_t>::max());
      field.bits = most > field.least ? uint32_t(std::bit_width(uint64_t(most) - uint64_t(field.least))) : 0;
      if (type == "ScaledInteger")
        field.scale = node.attribute("scale").as_double(1), field.offset = node.attribute("offset").as_double(0);
    } else {
      return field;  // texts
    }
    const std::string_view name = field.name;
    if (name == (cartesian ? "cartesianInvalidState" : "sphericalInvalidState"))
      scan.invalid = scan.fields.size(), field.read = true;
    field.coordinate = name.starts_with(cartesian ? "cartesian" : "spherical") && column_of(name).size() == 1;
    const std::string column = name.starts_with(cartesian ? "spherical" : "cartesian") ? "" : column_of(name);
    if (column.empty()) return field;
    if (name == "colorRed") real_colours_ = field.real;
    const auto found = std::find(columns_.begin(), columns_.end(), column);
    field.column = int(found - columns_.begin()), field.read = true;
    if (found == columns_.end()) columns_.push_back(column);
    if (columns_.size() > kMaxColumns) refuse("{}: more than {} numbers a point", name_, kMaxColumns);
    return field;
  }

  // Joins the bytes of each field, which its packets hold.
  void read_streams(Scan& scan) const {
    const std::string head = bytes_at(scan.at, kSectionHeader, "a section of points");
    const auto size = number<uint64_t>(head, 8);
    if (head[0] != 1 || size < kSectionHeader) refuse("{}: is damaged: no points at byte {}", name_, scan.at);
    const auto data = number<uint64_t>(head, 16);
    const uint64_t ahead = logical(data) - logical(scan.at);
    if (data < scan.at || ahead > size) refuse("{}: is damaged: its packets begin at byte {}", name_, data);
    const std::string packets = bytes_at(data, size - ahead, "a section of points");
    for (size_t at = 0; at + 4 <= packets.size();) {
      const size_t bytes = number<uint16_t>(packets, at + 2) + size_t{1}, end = at + bytes;
      if (end > packets.size()) refuse("{}: is truncated: a packet of {} bytes ends too early", name_, bytes);
      if (packets[at] == 1) take_packet(std::string_view(packets).substr(at, bytes), scan);
      at = end;
    }
    for (const Field& field : scan.fields)
      if (field.read && field.bits > 0 && field.stream.size() * uint64_t{8} / field.bits < scan.count)
        refuse("{}: is truncated: {} of {} points have a {}", name_, field.stream.size() * 8 / field.bits, scan.count,
               field.name.substr(0, 40));
  }

  void take_packet(std::string_view packet, Scan& scan) const {
    const size_t streams = packet.size() < 6 ? 0 : number<uint16_t>(packet, 4);
    size_t at = 6 + 2 * streams;
    if (streams != scan.fields.size() || at > packet.size())
      refuse("{}: is damaged: a packet has {} streams, points {} numbers", name_, streams, scan.fields.size());
    for (size_t i = 0; i < streams; ++i) {
      const size_t bytes = number<uint16_t>(packet, 6 + 2 * i);
      if (bytes > packet.size() - at) refuse("{}: is damaged: a stream ends behind its packet", name_);
      if (scan.fields[i].read) scan.fields[i].stream += packet.substr(at, bytes);
      at += bytes;
    }
  }

  static uint64_t logical(uint64_t at) { return at / kPage * kPayload + at % kPage; }

  static double value_of(const Field& field, uint64_t i) {
    if (field.real) return field.bits == 32 ? number<float>(field.stream, 4 * i) : number<double>(field.stream, 8 * i);
    uint64_t raw = 0;
    const uint64_t first = i * field.bits;
    for (uint64_t got = 0, byte = first / 8; got < field.bits + first % 8; got += 8, ++byte) {
      const uint64_t eight = uint8_t(field.stream[byte]);
      raw |= got == 0 ? eight >> first % 8 : got - first % 8 < 64 ? eight << (got - first % 8) : 0;
    }
    if (field.bits < 64) raw &= (uint64_t{1} << field.bits) - 1;
    return double(int64_t(uint64_t(field.least) + raw)) * field.scale + field.offset;
  }

  glm::dvec3 place_of(const Scan& scan, uint64_t i) const {
    glm::dvec3 p(std::numeric_limits<double>::quiet_NaN());
    for (const Field& field : scan.fields)
      if (field.coordinate) p[columns_[size_t(field.column)][0] - 'x'] = value_of(field, i);
    if (scan.spherical)
      p = p.x * glm::dvec3(std::cos(p.z) * std::cos(p.y), std::cos(p.z) * std::sin(p.y), std::sin(p.z));
    return scan.place == scan.place ? scan.rotation * p + scan.place : p;
  }

  // Adds every n-th point; the box has all. Returns the number of points that were left out.
  uint64_t add_points(const Scan& scan, uint64_t step, PointRows& rows) {
    uint64_t invalid = 0;
    std::vector<double> row(columns_.size());
    size_t places[3];
    for (size_t k = 0; k < 3; ++k)
      places[k] = size_t(std::find(columns_.begin(), columns_.end(), std::string(1, char('x' + k))) - columns_.begin());
    for (uint64_t i = 0; i < scan.count; ++i) {
      if (scan.invalid && value_of(scan.fields[*scan.invalid], i) != 0) {
        ++invalid;
        continue;
      }
      const glm::dvec3 p = place_of(scan, i);
      box_.extend(p);
      if (i % step != 0) continue;
      std::fill(row.begin(), row.end(), std::numeric_limits<double>::quiet_NaN());
      for (const Field& field : scan.fields)
        if (field.column >= 0) row[size_t(field.column)] = value_of(field, i);
      for (int k = 0; k < 3; ++k) row[places[k]] = p[k];
      rows.add(row);
    }
    return invalid;
  }

  std::string_view content_;
  const std::string& name_;
  std::vector<std::string> columns_;
  std::vector<Scan> scans_;
  std::optional<Reference> reference_;
  geometry::DBox box_;
  size_t pictures_ = 0;
  bool real_colours_ = false;
};

}  // namespace

ReadCloud read_e57(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array, uint64_t most_points) {
  return or_error([&] { return E57Reader(content, name).read(progress, array, most_points); });
}

}  // namespace telesplat::data
