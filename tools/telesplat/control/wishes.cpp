#include "tools/telesplat/control/wishes.h"

#include "tools/telesplat/control/json_fields.h"

namespace telesplat::launcher {

std::vector<Wish> wishes_of(const nlohmann::json& status) {
  using Json = nlohmann::ordered_json;
  const Json told = status;
  const Json* session = field(told, "session");
  std::vector<Wish> out;
  for (const Json& w : array(told, "wishes")) {
    const Json* arguments = field(w, "arguments");
    Wish wish{count(w, "number"), session ? count(*session, "pid") : 0, text(w, "command"),
              arguments ? text(*arguments, "value") : std::string()};
    if (wish.number > 0 && !wish.order.empty()) out.push_back(std::move(wish));
  }
  return out;
}

}  // namespace telesplat::launcher
