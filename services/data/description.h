// A description that `telesplat inspect` prints: a table for users, and JSON with all values for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/geometry/box.h"

namespace telesplat::data {

class Description {
 public:
  /// what: for programs ("mesh"); title: the first line for users.
  Description(const std::string& what, std::string title);

  /// Adds a row to the table. Without a label it continues the row above.
  void row(std::string label, std::string text) { rows_.emplace_back(std::move(label), std::move(text)); }
  /// Returns the table, each line ended by a line feed; control characters from files' texts are replaced.
  std::string table() const;
  std::string to_json() const;  ///< indented; bytes that are not UTF-8 are replaced

  nlohmann::ordered_json json;  ///< begins with "what"

 private:
  std::string title_;
  std::vector<std::pair<std::string, std::string>> rows_;
};

std::string bytes_text(uint64_t bytes);  ///< "812 bytes", "1.3 MB"
/// Returns "0 .. 240": both ends with as many digits as distinguish them.
std::string range_text(double lo, double hi);
std::string vector_text(const glm::dvec3& v);  ///< "(1, 2.5, -3)"
std::string extent_text(const glm::dvec3& v);  ///< "1 x 2.5 x 3"
nlohmann::ordered_json vector_json(const glm::dvec3& v);
nlohmann::ordered_json box_json(const geometry::DBox& box);  ///< "lo", "hi"

/// Adds the position in the room: a row each for the box and for the axis that points up, and both as JSON "room".
void describe_room(Description& out, const geometry::Box& box_room, const std::string& up, const std::string& reason);

}  // namespace telesplat::data
