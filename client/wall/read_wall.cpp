#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <set>
#include <string>
#include <vector>

#include "client/wall/keys.h"
#include "client/wall/screen_camera.h"
#include "client/wall/wall.h"
#include "common/core/whole_file.h"

namespace telesplat::wall {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

// ---- screens that stand in rows and columns: on a plane, or on a cylinder around the head

/// Values that all screens of a grid share.
struct Panel {
  double width_m = 0, height_m = 0;
  int width = 0, height = 0;
  Bezel bezel;
  std::optional<std::pair<int, int>> sampling;
  /// From a screen's middle to the next one's, where they touch.
  double pitch_x() const { return width_m + bezel.left + bezel.right; }
  double pitch_y() const { return height_m + bezel.bottom + bezel.top; }
};

struct Grid {
  std::string name;  ///< prefix of its screens' names
  int columns = 1, rows = 1;
  Panel panel;
  int screens_per_node = 1;
  int first_node = 0;
};

struct Arc {
  glm::dvec3 centre{0.0};  ///< on the cylinder's axis, which is vertical, as high as the middle of its screens
  double radius_m = 0;     ///< from the axis to the middle of each picture
  double turn_deg = 0;     ///< direction of the middle column, to the left of straight on
  double column_deg = 0;   ///< angle from one column to the next; 0: outer edges touch
};

// Makes a screen without its pose: the caller fills that in.
Screen screen_of(const Grid& grid, int row, int column) {
  const Panel& p = grid.panel;
  Screen s;
  s.name = fmt::format("{}, row {}, column {}", grid.name, row + 1, column + 1);
  s.width_m = p.width_m, s.height_m = p.height_m;
  s.width = p.width, s.height = p.height;
  s.bezel = p.bezel;
  s.sampling = p.sampling;
  s.node = grid.first_node + (row * grid.columns + column) / grid.screens_per_node;
  // Middle of the picture; uneven bezels move it away from the middle of the screen.
  const glm::dvec2 off((p.bezel.left - p.bezel.right) / 2, (p.bezel.bottom - p.bezel.top) / 2);
  s.unrolled_m =
      glm::dvec2((column - (grid.columns - 1) / 2.0) * p.pitch_x(), ((grid.rows - 1) / 2.0 - row) * p.pitch_y()) + off;
  return s;
}

// Yaws about +y, then pitches about the turned x axis, then rolls about the axis towards the viewer; degrees.
glm::dquat turned(double yaw_deg, double pitch_deg, double roll_deg) {
  const auto about = [](double degrees, const glm::dvec3& axis) { return glm::angleAxis(degrees * kDegree, axis); };
  return about(yaw_deg, {0, 1, 0}) * about(pitch_deg, {1, 0, 0}) * about(roll_deg, {0, 0, 1});
}

// Places touching screens in the plane of `middle`, around its origin, which lies at `middle_m` of the unrolled wall.
std::vector<Screen> planar_grid(const Grid& grid, const geometry::Pose& middle, const glm::dvec2& middle_m) {
  std::vector<Screen> out;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      Screen s = screen_of(grid, row, column);
      s.pose = {middle.position_room + middle.orientation * glm::dvec3(s.unrolled_m, 0), middle.orientation};
      s.unrolled_m += middle_m;
      out.push_back(std::move(s));
    }
  return out;
}

// Returns the angle between columns of an arc whose screens touch, in degrees.
double touching_deg(const Panel& panel, double radius_m) {
  return 2 * std::atan(panel.pitch_x() / 2 / radius_m) / kDegree;
}

// Places columns of screens around the axis; they face it.
std::vector<Screen> cylindrical_arc(const Grid& grid, const Arc& arc) {
  const double step = arc.column_deg > 0 ? arc.column_deg : touching_deg(grid.panel, arc.radius_m);
  std::vector<Screen> out;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      Screen s = screen_of(grid, row, column);
      const double across = (grid.panel.bezel.left - grid.panel.bezel.right) / 2;
      const glm::dquat turn = turned(arc.turn_deg - (column - (grid.columns - 1) / 2.0) * step, 0, 0);
      s.pose = {arc.centre + turn * glm::dvec3(across, s.unrolled_m.y, -arc.radius_m), turn};
      s.unrolled_m += glm::dvec2(-arc.turn_deg * kDegree * arc.radius_m, arc.centre.y);
      out.push_back(std::move(s));
    }
  return out;
}

// ---- a description

constexpr double kFarthest_m = 1e3, kLeastSide_m = 0.01, kMostSide_m = 50, kMostBezel_m = 1, kMostTurn_deg = 360;
constexpr int kLeastPixels = 16, kMostAcross = 64;

glm::dvec3 point(Keys& keys, const char* key, const std::array<double, 3>& fallback = {0, 0, 0}) {
  const auto v = keys.numbers<3>(key, fallback, -kFarthest_m, kFarthest_m);
  return {v[0], v[1], v[2]};
}

geometry::Pose pose(Keys& keys, const char* position, const char* turn) {
  const auto t = keys.numbers<3>(turn, {0, 0, 0}, -kMostTurn_deg, kMostTurn_deg);
  return {point(keys, position), turned(t[0], t[1], t[2])};
}

// Takes one number for all sides, or left, right, bottom, top; two or three numbers would be ambiguous.
Bezel bezel(Keys& keys) {
  const auto v = keys.list("bezel", {0}, 1, 4, 0, kMostBezel_m);
  if (v.size() == 4) return {v[0], v[1], v[2], v[3]};
  return {v[0], v[0], v[0], v[0]};
}

std::pair<int, int> pixels(Keys& keys, const char* key) {
  const auto v = keys.numbers<2>(key, {kLeastPixels, kLeastPixels}, kLeastPixels, geometry::kMaxImageSide);
  if (v[0] != std::floor(v[0]) || v[1] != std::floor(v[1])) keys.refuse(key, "are no whole numbers");
  return {int(v[0]), int(v[1])};
}

Panel panel(Keys& keys) {
  keys.require("size");
  keys.require("resolution");
  const auto size = keys.numbers<2>("size", {1, 1}, kLeastSide_m, kMostSide_m);
  const auto [width, height] = pixels(keys, "resolution");
  Panel out{size[0], size[1], width, height, bezel(keys), {}};
  if (keys.has("sampling")) out.sampling = pixels(keys, "sampling");
  return out;
}

// Builds a wall from its file.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {}

  Result<Wall> read(const toml::table& table) {
    for (const auto& [key, node] : table)
      if (const Status s = check_section(std::string(key.str()), node); !s) return s.error();
    if (const Status s = read_wall(table); !s) return s.error();
    if (const Status s = read_head(table); !s) return s.error();
    for (const auto& [section, read] : {std::pair{"planar", &Reader::read_planar},
                                        {"cylindrical", &Reader::read_cylindrical},
                                        {"screen", &Reader::read_screen}})
      if (const auto* list = table[section].as_array()) {
        int number = 0;
        for (const toml::node& element : *list) {
          const std::string name = list->size() == 1 ? section : fmt::format("{} {}", section, number + 1);
          Keys keys(*element.as_table(), path_, fmt::format("[[{}]] {}", section, ++number));
          (this->*read)(keys, name);
          if (const Status s = keys.done(); !s) return s.error();
        }
      }
    return checked();
  }

 private:
  Error refuse(const std::string& what) const { return Error{fmt::format("{}: {}", path_, what)}; }

  Status check_section(const std::string& name, const toml::node& node) const {
    const auto wrong = [&](const std::string& what) {
      return Error{fmt::format("{}:{}: {}", path_, node.source().begin.line, what)};
    };
    if (name == "wall" || name == "head")
      return node.is_table() ? ok_status() : Status(wrong(fmt::format("{} is no table: [{}]", name, name)));
    if (name != "planar" && name != "cylindrical" && name != "screen")
      return wrong(fmt::format("{} is none of [wall], [head], [[planar]], [[cylindrical]], [[screen]]", name));
    return node.is_array_of_tables() ? ok_status()
                                     : Status(wrong(fmt::format("{} is no list of tables: [[{}]]", name, name)));
  }

  Status read_wall(const toml::table& table) {
    static const toml::table kNone;
    const auto* section = table["wall"].as_table();
    Keys keys(section ? *section : kNone, path_, "[wall]");
    wall_.name = keys.text("name", std::filesystem::path(path_).stem().string());
    const std::string anchor = keys.text("anchor", "room");
    if (anchor != "room" && anchor != "head") keys.refuse("anchor", fmt::format("\"{}\" is not room or head", anchor));
    wall_.anchor = anchor == "head" ? Anchor::kHead : Anchor::kRoom;
    if (wall_.anchor == Anchor::kHead)
      for (const char* key : {"position", "turn"})
        if (keys.has(key)) keys.refuse(key, "a wall with anchor = \"head\" is where the head takes it");
    wall_.in_room = pose(keys, "position", "turn");
    return keys.done();
  }

  Status read_head(const toml::table& table) {
    const auto* section = table["head"].as_table();
    if (!section) return refuse("[head] is missing: position = [x, y, z] says from where the wall is seen");
    Keys keys(*section, path_, "[head]");
    keys.require("position");
    wall_.head = point(keys, "position");
    return keys.done();
  }

  Grid grid(Keys& keys, const std::string& name) {
    Grid out;
    out.name = name;
    out.columns = keys.whole("columns", 1, 1, kMostAcross);
    out.rows = keys.whole("rows", 1, 1, kMostAcross);
    out.panel = panel(keys);
    out.screens_per_node = keys.whole("screens_per_node", 1, 1, kMostScreens);
    out.first_node = wall_.nodes();
    if (out.columns * out.rows > kMostScreens)
      keys.refuse("columns", fmt::format("{} x {} screens, limit {}", out.columns, out.rows, kMostScreens));
    return out;
  }

  void add(std::vector<Screen> screens) {
    if (wall_.screens.size() + screens.size() > size_t(2 * kMostScreens)) return;  // refused as too many anyway
    for (Screen& s : screens) wall_.screens.push_back(std::move(s));
  }

  // Default place on the unrolled wall: along a circle around the head whose radius is the pose's distance.
  glm::dvec2 around_head(const geometry::Pose& pose) const {
    const glm::dvec3 from = pose.position_room - wall_.head;
    return {std::atan2(from.x, -from.z) * std::hypot(from.x, from.z), pose.position_room.y};
  }

  void read_planar(Keys& keys, const std::string& name) {
    const Grid g = grid(keys, name);
    const geometry::Pose middle = pose(keys, "centre", "turn");
    const bool turns = std::abs(std::abs(middle.orientation.w) - 1) > 1e-12;
    const glm::dvec2 middle_m = turns ? around_head(middle) : glm::dvec2(middle.position_room);
    if (g.columns * g.rows <= kMostScreens) add(planar_grid(g, middle, middle_m));
  }

  void read_cylindrical(Keys& keys, const std::string& name) {
    const Grid g = grid(keys, name);
    keys.require("radius");
    Arc arc;
    arc.centre = point(keys, "centre");
    arc.radius_m = keys.number("radius", 1, 0.05, kFarthest_m);
    arc.turn_deg = keys.number("turn", 0, -kMostTurn_deg, kMostTurn_deg);
    arc.column_deg = keys.number("column_angle", 0, 0.01, 180);
    const double least = touching_deg(g.panel, arc.radius_m), step = arc.column_deg > 0 ? arc.column_deg : least;
    if (arc.column_deg > 0 && arc.column_deg < least - 1e-9)
      keys.refuse("column_angle", fmt::format("{} degrees: screens of {} m overlap below {:.3f} on a radius of {} m",
                                              arc.column_deg, g.panel.pitch_x(), least, arc.radius_m));
    else if (g.columns * step > 360 + 1e-9)
      keys.refuse("columns", fmt::format("{} columns of {:.3f} degrees are more than a whole turn", g.columns, step));
    else if (g.columns * g.rows <= kMostScreens)
      add(cylindrical_arc(g, arc));
  }

  void read_screen(Keys& keys, const std::string& name) {
    const Panel p = panel(keys);
    Screen s;
    s.name = keys.text("name", name);
    s.node = keys.whole("node", wall_.nodes(), 0, kMostScreens - 1);
    keys.require("position");
    s.pose = pose(keys, "position", "turn");
    s.width_m = p.width_m, s.height_m = p.height_m, s.width = p.width, s.height = p.height;
    s.bezel = p.bezel, s.sampling = p.sampling;
    const glm::dvec2 around = around_head(s.pose);
    const auto place = keys.numbers<2>("unrolled", {around.x, around.y}, -kFarthest_m, kFarthest_m);
    s.unrolled_m = {place[0], place[1]};
    add({s});
  }

  Result<Wall> checked() {
    if (wall_.screens.empty()) return refuse("has no screens: [[planar]], [[cylindrical]] or [[screen]]");
    if (wall_.screens.size() > size_t(kMostScreens))
      return refuse(fmt::format("has {} screens, limit {}", wall_.screens.size(), kMostScreens));
    std::set<int> nodes;
    for (const Screen& s : wall_.screens) {
      nodes.insert(s.node);
      const glm::dvec3 normal = s.pose.orientation * glm::dvec3(0, 0, 1);
      const double before_m = glm::dot(wall_.head - s.pose.position_room, normal);
      if (before_m < kNearestEye_m)
        return refuse(fmt::format(
            "[head] position [{}, {}, {}]: is {:.3f} m before the screen {}, limit {}: pictures are seen from +z",
            wall_.head.x, wall_.head.y, wall_.head.z, before_m, s.name, kNearestEye_m));
    }
    if (*nodes.rbegin() + 1 != int(nodes.size()))
      return refuse(fmt::format("[[screen]] node: {} nodes are numbered up to {}; none may be left out", nodes.size(),
                                *nodes.rbegin()));
    return wall_;
  }

  const std::string& path_;
  Wall wall_;
};

}  // namespace

int Wall::nodes() const {
  int out = 0;
  for (const Screen& s : screens) out = std::max(out, s.node + 1);
  return out;
}

std::vector<int> Wall::screens_of(int node) const {
  std::vector<int> out;
  for (size_t i = 0; i < screens.size(); ++i)
    if (screens[i].node == node) out.push_back(int(i));
  return out;
}

Result<Wall> parse_wall(const std::string& text, const std::string& path) {
  try {
    return Reader(path).read(toml::parse(text, path));
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
}

Result<Wall> read_wall(const std::string& path) {
  const auto text = read_whole(path, kMostDescriptionBytes);
  return text ? parse_wall(*text, path) : text.error();
}

Wall scaled(Wall wall, double scale) {
  const auto fewer = [scale](int side) { return std::max(kLeastPixels, int(std::lround(side * scale))); };
  for (Screen& s : wall.screens) {
    s.width = fewer(s.width), s.height = fewer(s.height);
    if (s.sampling) s.sampling = {fewer(s.sampling->first), fewer(s.sampling->second)};
  }
  return wall;
}

}  // namespace telesplat::wall
