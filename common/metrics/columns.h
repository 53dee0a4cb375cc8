// A table of measurements, one row of code a column: its name, and the function that takes its value from a record.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace telesplat::metrics {

/// Value: double if rows are sent as numbers, std::string if a file prescribes the format of each number.
template <class Row, class Value = double>
struct Column {
  const char* name;
  Value (*get)(const Row&);
};

/// Names in the order of the columns.
template <class Row, class Value>
std::vector<std::string> names(std::span<const Column<Row, Value>> columns) {
  std::vector<std::string> out;
  out.reserve(columns.size());
  for (const Column<Row, Value>& c : columns) out.emplace_back(c.name);
  return out;
}

/// Values of all columns for one record, in their order.
template <class Row, class Value>
std::vector<Value> values(std::span<const Column<Row, Value>> columns, const Row& row) {
  std::vector<Value> out;
  out.reserve(columns.size());
  for (const Column<Row, Value>& c : columns) out.push_back(c.get(row));
  return out;
}

/// The same for an array: `constexpr Column<Row> kColumns[]`.
template <class Row, class Value, size_t N>
std::vector<std::string> names(const Column<Row, Value> (&columns)[N]) {
  return names(std::span<const Column<Row, Value>>(columns));
}
template <class Row, class Value, size_t N>
std::vector<Value> values(const Column<Row, Value> (&columns)[N], const Row& row) {
  return values(std::span<const Column<Row, Value>>(columns), row);
}

}  // namespace telesplat::metrics
