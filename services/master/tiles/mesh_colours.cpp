#include "services/master/tiles/mesh_colours.h"

#include <fmt/format.h>

#include <charconv>

#include "common/scene/session.h"

namespace telesplat::master {
namespace {

std::string array_of(const std::optional<scene::Colouring>& colouring) { return colouring ? colouring->array : ""; }

}  // namespace

bool MeshColours::adopt(const wire::Hello& data, std::string& problem) {
  const auto fact = [&](const char* name) { return scene::value_or(data.facts, name, std::string()); };
  is_mesh_ = scene::kind_named(fact("kind")) == scene::Kind::kMesh;
  const std::string told = fact(scene::kColouringFact), hash = fact("content_hash");
  const bool another = told != told_ || hash != content_hash_;
  told_ = told, content_hash_ = hash;
  if (!is_mesh_) {
    order_.reset();
    return std::exchange(now_, std::nullopt).has_value();
  }
  auto arrays = scene::arrays_from_text(fact(scene::kArraysFact));
  if (!arrays) problem = arrays.error().text;
  arrays_ = arrays ? *std::move(arrays) : std::vector<scene::ArrayInfo>{};
  const std::string map = fact(scene::kColourMapFact);
  auto read_map = map.empty() ? colour::find_colour_map(colour::colour_map_names().front()) : colour::from_text(map);
  if (read_map)
    map_ = *std::move(read_map);
  else
    problem = read_map.error().text;
  if (!another) return hear_answer(fact(scene::kArrayAnswerFact), problem);
  order_.reset();
  auto begun = told.empty() ? Result<scene::Colouring>(scene::Colouring{}) : scene::colouring_from_text(told);
  if (!begun) problem = begun.error().text;
  auto before = std::exchange(now_, std::nullopt);
  if (begun && !told.empty()) now_ = *std::move(begun);
  return before != now_;
}

// Takes the answer to order N: "N", or "N REASON" if it failed. True: the mesh looks different.
bool MeshColours::hear_answer(const std::string& answer, std::string& problem) {
  uint64_t number = 0;
  const auto read = std::from_chars(answer.data(), answer.data() + answer.size(), number);
  if (!order_ || read.ec != std::errc() || number != order_->number) return false;
  const auto colouring = std::move(order_->colouring);
  order_.reset();
  const size_t blank = answer.find(' ');
  if (blank != answer.npos) {
    failure_ = problem =
        fmt::format("the array \"{}\" cannot be shown: {}", array_of(colouring), answer.substr(blank + 1));
    return false;
  }
  now_ = colouring;
  return true;
}

void MeshColours::describe(wire::Welcome& welcome) const {
  if (!is_mesh_) return;
  welcome.facts.erase(scene::kArrayAnswerFact);
  welcome.facts.erase(scene::kColouringFact);
  if (now_) welcome.facts[scene::kColouringFact] = text();
  if (order_) welcome.facts[scene::kArrayOrderFact] = fmt::format("{} {}", order_->number, array_of(order_->colouring));
}

std::string MeshColours::waits_for() const {
  if (!order_) return failure_;
  return fmt::format("{} {} being fetched", order_->colouring ? order_->colouring->array : "the file's own colours",
                     order_->colouring ? "is" : "are");
}

// Returns the colouring that the command asks for: changes the last order's, else the one that is shown.
Result<std::optional<scene::Colouring>> MeshColours::wanted(const wire::Control& command) const {
  const auto& last = order_ ? order_->colouring : now_;
  const auto array = command.arguments.find("array"), map = command.arguments.find("map");
  const bool has_array = array != command.arguments.end(), has_map = map != command.arguments.end();
  if (!has_array && !has_map) return Error{"colour: names neither an array nor a map"};
  colour::ColourMap colours = last ? last->map : map_;
  if (has_map) {
    auto read = colour::from_text(map->second);
    if (!read) return Error{"colour: " + read.error().text};
    colours = *std::move(read);
  }
  if (!has_array) {
    if (!last) return Error{"colour: the mesh shows its own colours; a map needs an array, such as ctl colour ARRAY"};
    auto out = last;
    out->map = std::move(colours);
    return out;
  }
  const auto by = scene::parse_colour_by(array->second);
  if (!by) return Error{"colour: " + by.error().text};
  if (by->array.empty()) return std::optional<scene::Colouring>();
  auto out = scene::make_colouring(arrays_, *by, std::move(colours));
  if (!out) return Error{"colour: " + out.error().text};
  return std::optional(*std::move(out));
}

Result<Obeyed> MeshColours::obey(const wire::Control& command) {
  if (!is_mesh_)
    return Error{content_hash_.empty() && told_.empty() ? "colour: no mesh is shown, so no array can colour it"
                                                        : "colour: the scene is no mesh and has no arrays"};
  auto colouring = wanted(command);
  if (!colouring) return colouring.error();
  failure_.clear();
  if (array_of(*colouring) == array_of(now_)) {
    order_.reset();
    now_ = *std::move(colouring);
    return Obeyed{.begins_epoch = true, .answer = {}};
  }
  order_ = Order{++orders_, *std::move(colouring)};
  const std::string name = array_of(order_->colouring);
  return Obeyed{.begins_epoch = false,
                .answer = fmt::format("{} being fetched; their epoch begins when they are there",
                                      name.empty() ? "the file's own colours are" : "the values of " + name + " are"),
                .tells_all = true};
}

}  // namespace telesplat::master
