// What the master writes into a run's folder beside the figures: session.toml.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "services/master/master_core.h"
#include "services/master/master_options.h"
#include "services/master/record/about.h"

namespace telesplat::master {

// What data servers and viewers tell session.toml of themselves. They may be anybody, and the file is read again by
// `telesplat compare` and its like.

/// A table of session.toml that a role tells, and its keys, in the order in which they are written.
struct ToldTable {
  std::string name;
  std::vector<std::string> keys;
};
/// Empty: that role tells none.
const std::vector<ToldTable>& told_tables(const std::string& role);

struct Told {
  std::string text;     ///< lines of TOML
  size_t left_out = 0;  ///< tables and keys that are not the role's, and values that are no text, number or boolean
};
/// What a process of this role says, written anew from what is understood of it, texts in quotes. Error: it is no TOML.
Result<Told> checked(const std::string& role, const std::string& said);

/// session.toml: what was run, the effective configuration of everyone who took part, and what data server and viewer
/// tell of scene and display (metrics::kRecordFact).
std::string session_text(const MasterServiceOptions& options, const MasterCore& core, const metrics::About& about,
                         const std::vector<metrics::Process>& processes);

}  // namespace telesplat::master
