// The tables of `telesplat top`: one a role, a row a process.
#pragma once

#include <functional>

#include "tools/telesplat/top/layout.h"

namespace telesplat::launcher {

struct TopColumn {
  std::string title;
  int importance = 0;  ///< where there is no room the least important go first
  std::function<std::string(const TopProcess&)> cell;
};

/// The first column are the names.
struct TopTable {
  std::string title;
  std::vector<TopColumn> columns;
  std::vector<const TopProcess*> rows;
  bool with_curves = false;  ///< each row is followed by curves of the last minute
};

/// Of the processes that are alive. sort: of samplers, the busiest or fastest first.
std::vector<TopTable> top_tables(const TopState& state, TopSort sort);

/// Title line and rows, no wider than `width`; none if the table has no rows. Columns in which nothing stands are left
/// out.
std::vector<TopLine> table_lines(const TopTable& table, size_t width);

/// "loose(3)"; empty: not told.
std::string coupling_of(const TopProcess& viewer);

}  // namespace telesplat::launcher
