// A master's answer to "status" as tables for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace telesplat::launcher {

/// status: as the master tells it (docs/metrics.md, "While it runs"); what it lacks is left out. now_s: the wall clock,
/// seconds since 1970.
std::string status_text(const nlohmann::ordered_json& status, double now_s);

/// Tables of "processes" of a status, one a role, and one of their links. Each begins with an empty line; those that
/// left are named at the end.
std::string process_tables(const nlohmann::ordered_json& processes);

/// "2026-11-22T19:54:26Z" as seconds since 1970; 0: it is not of this form.
double read_utc(const std::string& text);
/// This machine's time of day; the date too where that is not today's.
std::string local_time(double at_s, double now_s);

}  // namespace telesplat::launcher
