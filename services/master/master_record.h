// Writes session.toml, which a run's folder has beside the figures.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "services/master/master_core.h"
#include "services/master/master_options.h"
#include "services/master/record/about.h"

namespace telesplat::master {

// Data servers and viewers send tables of session.toml. The master does not trust them: `telesplat compare` and its
// like read the file again.

/// A table of session.toml that a role sends, and its keys in the order in which they are written.
struct ToldTable {
  std::string name;
  std::vector<std::string> keys;
};
/// Returns the tables that a role may send; empty: none.
const std::vector<ToldTable>& told_tables(const std::string& role);

struct Told {
  std::string text;     ///< lines of TOML
  size_t left_out = 0;  ///< tables and keys that the role may not send, and values of types that are not written
};
/// Writes the tables that a process of this role sent anew: its told_tables() only, texts in quotes. Error: not TOML.
Result<Told> checked(const std::string& role, const std::string& said);

/// Returns session.toml: the run, the effective configuration of all processes that took part, and what data server and
/// viewer sent about scene and display (metrics::kRecordFact).
std::string session_text(const MasterServiceOptions& options, const MasterCore& core, const metrics::About& about,
                         const std::vector<metrics::Process>& processes);

}  // namespace telesplat::master
