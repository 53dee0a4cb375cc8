// A table of measurements, one row of code a column: its name, and how its value comes out of a record.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace telesplat::metrics {

template <class Row>
struct Column {
  const char* name;
  double (*get)(const Row&);
};

/// In the order of the columns.
template <class Row>
std::vector<std::string> names(std::span<const Column<Row>> columns) {
  std::vector<std::string> out;
  out.reserve(columns.size());
  for (const Column<Row>& c : columns) out.emplace_back(c.name);
  return out;
}

/// What the columns make of one record, in their order.
template <class Row>
std::vector<double> values(std::span<const Column<Row>> columns, const Row& row) {
  std::vector<double> out;
  out.reserve(columns.size());
  for (const Column<Row>& c : columns) out.push_back(c.get(row));
  return out;
}

/// The same for an array: `constexpr Column<Row> kColumns[]`.
template <class Row, size_t N>
std::vector<std::string> names(const Column<Row> (&columns)[N]) {
  return names(std::span<const Column<Row>>(columns));
}
template <class Row, size_t N>
std::vector<double> values(const Column<Row> (&columns)[N], const Row& row) {
  return values(std::span<const Column<Row>>(columns), row);
}

}  // namespace telesplat::metrics
