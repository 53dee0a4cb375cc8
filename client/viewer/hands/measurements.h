// Places that a person measures: rows of them, with the distances between neighbours and the angles between. They stay
// until they are removed. No window, no sockets, no clocks.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/viewer/hands/meaning.h"

namespace telesplat::viewer {

class Measurements {
 public:
  static constexpr size_t kMost = 200;  ///< places

  using Probe = std::map<std::string, std::string>;  ///< arguments of the order
  struct Place {
    uint64_t number = 0;  ///< counts from 1, and is never used again
    scene::ToldPlace told;
    Probe asked;  ///< the probe whose answer is due; empty: no answer is due
  };
  using Row = std::vector<Place>;

  /// Adds a place behind the newest one, or the first of a row. take_probes() then has a question to the data server.
  /// Error: there are kMost already.
  Result<uint64_t> add(const Pick& pick, const SceneTerms& terms, EpochId epoch, double opacity);
  /// The next place begins a new row.
  void begin_row() { begins_ = true; }
  /// Error: there is no place of that number.
  Status remove(uint64_t number);
  void clear();

  std::vector<Probe> take_probes() { return std::exchange(probes_, {}); }
  /// Takes the data server's answer, or why it gave none. Returns a line for the person; empty: no place waits for it.
  std::string on_answer(const Probe& asked, bool found, const std::string& text);

  const std::vector<Row>& rows() const { return rows_; }
  const scene::Placement& placement() const { return placement_; }
  bool empty() const { return rows_.empty(); }
  /// Changes with each change of the places.
  uint64_t version() const { return version_; }

  /// Describes a place by those before it in its row, in one line: "12.5 mm from 1, 90.00 degrees at 1".
  std::string between(const Row& row, size_t index) const;
  /// JSON: {"places": [as to_json(ToldPlace), "number", "row", "distance", "angle_deg"], "unit"}.
  std::string list() const;
  /// The same as a table, one line a place.
  std::string csv() const;

 private:
  std::vector<Row> rows_;
  std::vector<Probe> probes_;
  scene::Placement placement_;
  uint64_t last_ = 0, version_ = 0;
  bool begins_ = true;
};

}  // namespace telesplat::viewer
