#include "runtime/pressure/nodal_body.h"

#include "common/base/exception_carrier.h"

namespace archetide {

std::shared_ptr<const NodalBody> NodalBody::with_rows(
    std::shared_ptr<const RowAnswers> rows) const {
  auto body = std::make_shared<NodalBody>(*this);
  body->rows_ = std::move(rows);
  return body;
}

void NodalBody::answer_in_solve(const std::vector<const NodalBody*>& bodies, std::vector<MatX>& f) {
  ExceptionCarrier carrier;
  std::vector<const NodalInverse*> inverses;
  for (const NodalBody* body : bodies) inverses.push_back(&body->inverse());
#pragma omp parallel for schedule(dynamic) if (bodies.size() > 1)
  for (std::size_t b = 0; b < bodies.size(); ++b)
    carrier.run([&] { f[b] = bodies[b]->surface().to_body(f[b]); });
  carrier.rethrow();
  NodalInverse::solve(inverses, f);
#pragma omp parallel for schedule(dynamic) if (bodies.size() > 1)
  for (std::size_t b = 0; b < bodies.size(); ++b)
    carrier.run([&] { f[b] = bodies[b]->surface().to_solve(f[b]); });
  carrier.rethrow();
}

}  // namespace archetide
