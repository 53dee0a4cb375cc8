// Reads any bytes as each text of people, files and messages: gives an error with a text, or a value that survives
// writing and reading. The first byte chooses the reader in the table below.
#include <cstdlib>

#include "client/notes/book.h"
#include "client/stereo/autostereo/panel_file.h"
#include "client/wall/wall.h"
#include "common/colour/paraview_json.h"
#include "common/core/utf8.h"
#include "common/geometry/clip.h"
#include "common/geometry/trajectory.h"
#include "common/image/background.h"
#include "common/julia/flags.h"
#include "common/julia/timeline.h"
#include "common/links/link.h"
#include "common/net/keys/access.h"
#include "common/scene/arrays.h"
#include "common/scene/clip_order.h"
#include "common/scene/colouring.h"
#include "common/scene/placement.h"
#include "common/volume/transfer/function.h"
#include "common/wire/head_pose.h"
#include "tests/support/files/memory_file.h"

namespace telesplat {
namespace {

constexpr volume::ValueRange kRange{-10, 300, 0, 200, false};

void must(bool holds) {
  if (!holds) std::abort();
}
template <class T>
bool read(const Result<T>& result) {
  if (!result) must(!result.error().text.empty());
  return result.ok();
}

void transfer(std::string_view text) {
  for (const auto& f : {volume::parse_transfer(text, kRange), volume::parse_paraview_json(text, "fuzz", kRange)}) {
    if (!read(f)) continue;
    must(volume::validate(*f).ok());
    const auto again = volume::parse_transfer(volume::to_text(*f), kRange);
    must(again.ok() && *again == *f);
    volume::level_colours(*f, {-10, 300, 256});
  }
}
void colours(std::string_view text) {
  for (const auto& map : {colour::from_text(text), colour::parse_colour_map(text, "fuzz")}) {
    if (!read(map)) continue;
    must(colour::validate(*map).ok());
    const auto again = colour::from_text(colour::to_text(*map));
    must(again.ok() && *again == *map);
    for (const double x : {-1.0, 0.0, 0.3, 1.0, 2.0}) map->at(x);
  }
  read(image::parse_background(std::string(text)));
}
void colouring(std::string_view text) {
  if (const auto by = scene::parse_colour_by(text); read(by) && by->has_range) must(by->lo < by->hi);
  if (const auto c = scene::colouring_from_text(text); read(c)) {
    const auto again = scene::colouring_from_text(scene::to_text(*c));
    must(again.ok() && *again == *c);
    scene::make_table(*c).at(0.5f);
  }
  if (const auto arrays = scene::arrays_from_text(text); read(arrays)) read(scene::choose_array(*arrays, "a.x"));
}
void places(std::string_view text) {
  const auto placement = scene::placement_from_text(text);
  if (read(placement)) {
    const auto again = scene::placement_from_text(scene::to_text(*placement));
    must(again.ok() && *again == *placement);
  }
  if (const auto clip = geometry::clip_from_text(text); read(clip))
    must(geometry::clip_from_text(geometry::to_text(*clip)).ok());
  if (const auto order = scene::parse_clip(text); read(order)) {
    must(order->planes.size() <= geometry::Clip::kMostPlanes);
    read(scene::place_clip(*order, placement ? *placement : scene::Placement{}));
  }
}
void timeline(std::string_view text) {
  if (const auto t = julia::parse_timeline(text); read(t)) {
    const auto again = julia::parse_timeline(t->text());
    must(again.ok() && again->tracks.size() == t->tracks.size());
    for (const double s : {0.0, 0.7, 1e6}) t->values(s);
  }
  read(julia::read_value("c.x", std::string(text)));
}
void links_(std::string_view text) {
  if (const auto link = links::parse(text); read(link)) {
    const auto again = links::parse(links::text_of(*link));
    must(again.ok());
    links::queue_bytes(*link);
  }
  read(links::parse_placed(text));
  read(net::Via::parse({std::string(text)}));
}
void notes_(std::string_view text) {
  const auto book = notes::book_from_json(text);
  if (!read(book)) return;
  const auto again = notes::book_from_json(notes::to_json(*book));
  must(again.ok() && *again == *book);
}
void walls(std::string_view text) {
  const auto wall = wall::parse_wall(std::string(text), "fuzz");
  if (!read(wall)) return;
  must(!wall->screens.empty() && wall->screens.size() <= size_t(wall::kMostScreens));
  wall::scaled(*wall, 0.1);
}
void files(std::string_view text) {
  const test::MemoryFile file({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  read(stereo::read_panel(file.path()));
  if (const auto samples = geometry::read_samples(file.path()); read(samples)) {
    const auto t = geometry::Trajectory::of(*samples);
    for (const double s : {-1.0, 0.0, 0.5, 1e9}) t.at(s);
  }
}
void head_pose(std::string_view text) {
  const auto pose = wire::decode_head_pose(std::as_bytes(std::span(text)));
  if (!read(pose)) return;
  const std::string again = wire::encode_head_pose(*pose);
  must(wire::decode_head_pose(std::as_bytes(std::span(again))).ok());
}

}  // namespace
}  // namespace telesplat

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  constexpr void (*kReaders[])(std::string_view) = {transfer, colours, colouring, places, timeline,
                                                    links_,   notes_,  walls,     files,  head_pose};
  if (size == 0) return 0;
  kReaders[data[0] % std::size(kReaders)]({reinterpret_cast<const char*>(data) + 1, size - 1});
  return 0;
}
