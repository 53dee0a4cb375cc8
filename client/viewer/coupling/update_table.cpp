#include "client/viewer/coupling/update_table.h"

#include "common/metrics/columns.h"

namespace telesplat::viewer {
namespace {

using U = const MeasuredUpdate&;

constexpr metrics::Column<MeasuredUpdate> kColumns[] = {
    {"request", [](U m) { return double(m.update.request.value); }},
    {"frame", [](U m) { return double(m.last.frame.value); }},
    {"requested_s", [](U m) { return m.update.requested_s; }},
    {"first_s", [](U m) { return m.update.first_s; }},
    {"complete_s", [](U m) { return m.update.complete_s; }},
    {"latency_ms", [](U m) { return (m.update.complete_s - m.update.requested_s) * 1e3; }},
    {"start_up_ms", [](U m) { return (m.update.first_s - m.update.requested_s) * 1e3; }},
    {"tiles", [](U m) { return double(m.update.tiles); }},
    {"samples", [](U m) { return double(m.update.samples); }},
    {"points", [](U m) { return double(m.update.points); }},
    {"bytes", [](U m) { return double(m.update.bytes); }},
    {"eliminated", [](U m) { return m.update.samples ? double(m.update.eliminated) / double(m.update.samples) : 0.0; }},
    {"sampling_width", [](U m) { return double(m.last.camera.width); }},
    {"sampling_height", [](U m) { return double(m.last.camera.height); }},
    {"epoch", [](U m) { return double(m.last.epoch.value); }},
    {"extra_points", [](U m) { return double(m.update.extra_points); }},
    {"extra_bytes", [](U m) { return double(m.update.extra_bytes); }},
    {"left_out", [](U m) { return double(m.last.left_out); }},
};

}  // namespace

std::vector<std::string> update_columns() { return metrics::names(kColumns); }
std::vector<double> update_row(const MeasuredUpdate& measured) { return metrics::values(kColumns, measured); }

}  // namespace telesplat::viewer
