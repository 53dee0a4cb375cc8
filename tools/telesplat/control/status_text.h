// A master's answer to "status" as tables for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace telesplat::launcher {

/// status: as the master sends it (docs/metrics.md, "While it runs"); missing fields are left out. now_s: the wall
/// clock, seconds since 1970.
std::string status_text(const nlohmann::ordered_json& status, double now_s);

/// Writes tables of the "processes" of a status, one a role, and one of their links. Each begins with an empty line;
/// the end names the processes that have left.
std::string process_tables(const nlohmann::ordered_json& processes);

/// Reads "2026-11-22T19:54:26Z" as seconds since 1970; 0: another form.
double read_utc(const std::string& text);
/// Writes this machine's time of day, with the date unless that is today.
std::string local_time(double at_s, double now_s);

}  // namespace telesplat::launcher
