// The stores of one mesh, each with another of its arrays in the chunks: those that are open, and the one that is being
// opened in a thread of its own.
#pragma once

#include <atomic>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "services/data/mesh/served_mesh.h"

namespace telesplat::data {

class ArrayStores {
 public:
  using Open = decltype(ServedColours::open);

  ArrayStores(std::shared_ptr<const MeshStore> first, const std::string& array, Open open);
  /// Gives up what is being opened, and waits until it is.
  ~ArrayStores();

  /// Null: it is not open.
  const MeshStore* find(const std::string& array) const;
  /// Opens it as soon as nothing else is being opened; only the one wanted last waits.
  void want(const std::string& array);
  bool busy() const { return opening_.valid(); }

  /// What became of a store that was wanted, once.
  struct Opened {
    std::string array;
    Status status;
  };
  std::optional<Opened> take_opened();

 private:
  using Made = Result<std::shared_ptr<MeshStore>>;
  void begin(const std::string& array);

  static constexpr size_t kKept = 4;  // the first one among them

  std::map<std::string, std::shared_ptr<const MeshStore>> open_;
  const std::string first_;
  Open open_array_;
  std::future<Made> opening_;
  std::string opening_array_;
  std::optional<std::string> next_;
  std::atomic<bool> stop_{false};
};

}  // namespace telesplat::data
