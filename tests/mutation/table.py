"""The mutants: small faults, put in one at a time, that some test must find.

A row: number, file, the place with the text that is replaced between « and », what replaces it, what is broken by that, and
the tests that should find it, in the order in which they are asked. Expressions are replaced by expressions of their type,
statements (with their semicolon) by statements. The first 60 are five areas of twelve; they were chosen by reading the code
alone, before the tests. From 101 on each drops or bends one term of the light: the quick table of `lightshaft validate` must
turn red for it. From 201 on each bends one technique of core/job/techniques.h by a few per cent: the test that it keeps the
expected image must see that.
"""
import collections

Mutant = collections.namedtuple("Mutant", "number file place new breaks tests")

AREAS = {"render": range(1, 13), "fold": range(13, 25), "lease": range(25, 37), "audit": range(37, 49), "authorisation": range(49, 61),
         "terms": range(101, 200), "techniques": range(201, 300)}

RENDER = ("validate:seed*", "validate:N37*", "validate:N05*", "validate:7.6c*", "render_test", "leave_out_test")
FOLD = ("image_test:Film*:Merge*:Aovs*:Partial*:Sums*:FinalImage*", "assemble_test")
DOMAIN = ("domain_test:-Month*:Scale*:RandomWalk*:AdaptiveStop*",)
HTTP = ("http_api_test",)
IMAGES = ("render_test:Techniques*:Splitting*:EmissiveGrids*:LocalLights*", "property_test:PathReuse.Keeps*:Connections.Transport*")
TABLE = ("validate:seed*", "validate:N41*", "validate:N22*", "validate:7.6[abcg]*")

ROWS = [
    # ---- render
    (1, "worker/render/integrator/surface_nee.h", "light->delta ? 1 : «balance_weight(light->pdf, sampled)»;", "1.f",
     "next-event estimation at surfaces counts in full beside the directions that hit the light", RENDER),
    (2, "worker/render/integrator/path_tracer.h", "if (!(u < q)) return false;\n  «beta_ /= q;»", ";", "survivors of roulette are not weighted up", RENDER),
    (3, "worker/render/integrator/path_tracer.h", "if («(dot(w, hit.ng) > 0) != (s->wi.z > 0)») return {Collision::absorbed};", "false",
     "a leaning shading normal sends paths through the true surface", RENDER),
    (4, "worker/render/media/medium.h", "} else if (f.scattered) {\n    for (int c = 0; c < 3; ++c) f.weight[c] = «m.sigma_s[c] / s»;", "1.f",
     "grey media forget their albedo", RENDER),
    (5, "worker/render/media/medium.h", "if («rho > hi») ++counters", "false", "densities above their bound are not counted", RENDER),
    (6, "worker/render/media/medium.h", "for (float& x : factor) «x /= q;»", ";", "shadow rays that survive roulette are not weighted up", RENDER),
    (7, "worker/render/integrator/vertex_nee.h", ": light->pdf / (light->pdf * with_equiangular +\n                                                      «path.direction_pdf(p, phase.pdf, light->direction)»);", "2 * phase.pdf",
     "in media, the weight of next-event estimation and that of found lights do not add up to 1", RENDER),
    (8, "worker/render/lights/lights.cpp", "return «cosine > 0 || (l.two_sided && cosine < 0)» ? l.emitted", "cosine != 0", "lights shine from their back", RENDER),
    (9, "worker/render/media/phase.h", "const V3 diff = «g >= 0 ? w - w1 : w + w1»;", "w - w1", "media that scatter backward are looked up as forward ones", RENDER),
    (10, "worker/render/math/sampler.h", "(std::uint64_t{y} << 32) | x), «sample & 1»), sample >> 1) {}", "std::uint64_t{0}",
     "both halves of a pixel draw the same numbers", RENDER),
    (11, "worker/render/integrator/render_tile.cpp", "if (!usable(out)) «continue;»", ";", "samples that are no numbers are added up", RENDER),
    (12, "worker/render/integrator/shadow_ray.h", "if (occluded(p, d, «left»)) return {0, 0, 0};", ".5f * left",
     "what stands in the farther half of a shadow ray throws no shadow", RENDER),
    # ---- fold
    (13, "core/image/film/film.cpp", "got.s1 > full.s1 || «got.s1 % 2 != 0»)", "false", "a round with unequal halves is folded", FOLD),
    (14, "core/image/film/film.cpp", "if (const auto cut = tail(index); cut && «got.s1 <= cut->s1»)", "got.s1 < cut->s1",
     "the same cut round is folded twice", FOLD),
    (15, "core/image/film/film.cpp", "«next->chain = chained(next->chain, digest);»", ";", "the sealed digest of a tile forgets its rounds", FOLD),
    (16, "core/image/film/film.cpp", "out.standard_error[3 * p + c] = «0.5» * std::abs", "1.0", "standard errors are twice too large", FOLD),
    (17, "core/image/film/film.cpp", "return «tile->tail ? chained(tile->chain, tile->tail->digest) : tile->chain»;", "tile->chain",
     "the cut last round is not sealed", FOLD),
    (18, "core/image/film/film.cpp", "out.sums[i] += «tile.tail->sums[colour + i]»;", "0.f", "AOVs miss the cut last round", FOLD),
    (19, "coordinator/assemble/assembly.cpp", "if (found == waiting_.end() || «found->second.samples != samples») return", "false",
     "a waiting partial of another sample range is folded", FOLD),
    (20, "coordinator/assemble/assembly.cpp", "film_.discard(tile);\n  «errors_.discard(tile);»", ";", "the errors of a discarded tile stay", FOLD),
    (21, "coordinator/assemble/round_errors.cpp", "while (!rounds.empty() && «rounds.back().first >= round»)", "rounds.back().first > round",
     "a round that is folded again counts twice among the errors", FOLD),
    (22, "core/image/film/merge.cpp", "return «std::tie(a.samples.s0, b.samples.s1) < std::tie(b.samples.s0, a.samples.s1)»;",
     "std::tie(a.samples.s0, a.samples.s1) < std::tie(b.samples.s0, b.samples.s1)", "of a cut round and the whole one, merge takes the cut one", FOLD),
    (23, "coordinator/assemble/verify.cpp", "if (const Digest digest = unit_digest(*partial); «digest != result.digest»)", "false",
     "a result whose pixels are not those of its digest is accepted", FOLD),
    (24, "coordinator/assemble/assembly.cpp", "«tails_.erase(tile);»\n  if (health.clean()) return;", ";",
     "a cut round that was rendered again in full stays among the faults", FOLD),
    # ---- lease
    (25, "coordinator/domain/farm/farm_leases.cpp", "«(worker.warmed_up.contains(job.seq) ? Duration{} : Duration{kLoadSlack})»;", "Duration{}",
     "a first lease has no time to load its world", DOMAIN),
    (26, "coordinator/domain/farm/farm_leases.cpp", "«--job.leased;»", ";", "units that come back stay counted as lent", DOMAIN),
    (27, "coordinator/domain/farm/farm_leases.cpp", "«shares.charge(job, -lease.charge_per_unit);»", ";", "a user is charged for leases that came back", DOMAIN),
    (28, "coordinator/domain/farm/farm_leases.cpp", "room = std::min(room, «units - std::min(units, load.units)»);", "units",
     "the limit of lent units does not count those that are lent", DOMAIN),
    (29, "coordinator/domain/farm/farm_leases.cpp", "if (lease->remaining == 0) close(*lease, «lease->worker != by»);", "false",
     "who renders a unit that another has handed in is not told to stop", DOMAIN),
    (30, "coordinator/domain/farm/farm_leases.cpp", "leases.renew(lease, «std::max(lease.deadline, deadline)»);", "deadline", "a renewal may shorten a lease", DOMAIN),
    (31, "coordinator/domain/worker_table.cpp", "«deadlines_.erase({lease.deadline, lease.seq});»", ";", "a renewed lease ends at its first deadline", DOMAIN),
    (32, "core/base/parse_number.h", "error == std::errc{} && «end == text.data() + text.size()» ?", "true",
     "a lease is known by an id with something behind it", DOMAIN),
    (33, "coordinator/domain/farm/farm_workers.cpp", "LeaseRecord* lease = leases.find(entry.lease);\n    if (lease == nullptr || «lease->worker != worker») continue;", "false",
     "a worker renews the leases of another one", DOMAIN),
    (34, "coordinator/domain/farm/farm_workers.cpp", "if («now - lease->progress_at < kNoGrowthLimit») renew(*lease);", "true",
     "a worker that finishes nothing holds its leases for ever", DOMAIN),
    (35, "coordinator/domain/farm/schedule.cpp", "if (!limit || job.frozen || «round_of(code) == 0») return false;", "false",
     "a time budget ends before every tile has its first round", DOMAIN),
    (36, "worker/agent/held_work.cpp", "«if (!is_new) leave(entry.held.lease, false);»", ";", "a unit that is lent again stays counted in its old lease", ("agent_test",)),
    # ---- audit
    (37, "coordinator/domain/farm/farm_trust.cpp", "mixed(mixed(«options.audit_seed ^ job.seq») ^ code)", "job.seq", "anybody can tell which units are audited", DOMAIN),
    (38, "coordinator/domain/farm/farm_trust.cpp", "if (!(draw < options.audit_rate) || «job.audits.size() >= kMaxAuditsOpen») return;", "false",
     "open audits have no bound", DOMAIN),
    (39, "coordinator/domain/farm/farm_trust.cpp", "if (audit.lease == 0 && «may_vote(job, audit, worker)») return code;", "true", "a worker audits its own result", DOMAIN),
    (40, "coordinator/domain/farm/farm_trust.cpp", "first.digest == event.digest || «first.digest == Digest{}»;", "false",
     "a result whose digest was not kept makes every other one differ", DOMAIN),
    (41, "coordinator/domain/farm/farm_trust.cpp", "«if (!asked) return;»", ";", "who was not asked confirms a result and ends its audit", DOMAIN),
    (42, "coordinator/domain/farm/farm_trust.cpp", "«if (!asked) return claimed(job, code, with);»", ";", "who was not asked has a vote against a result", DOMAIN),
    (43, "coordinator/domain/farm/farm_trust.cpp", "if («with.digest != claimed») return undecided(job, code);", "false",
     "of three different results the first is held for the wrong one", DOMAIN),
    (44, "coordinator/domain/farm/farm_trust.cpp", "«if (by == first.worker) return found_faulty(with.unit, by, contradiction(with, first.digest));»", ";",
     "a worker that contradicts itself is not found out by that", DOMAIN),
    (45, "coordinator/domain/farm/farm_trust.cpp", "binary_search(tiles.begin(), tiles.end(), tile_of(code)) ||\n           «(audit.second && audit.second->first == faulty)»;", "false",
     "an audit goes on by the word of a quarantined worker", DOMAIN),
    (46, "coordinator/domain/farm/farm_trust.cpp", "«if (!tiles.empty()) job.checkpoint_spp = 0;»", ";", "no checkpoint is made again of pixels that were wrong", DOMAIN),
    (47, "coordinator/domain/farm/farm_trust.cpp", "«while (!worker->leases.empty()) free_lease(*worker->leases.begin(), FreedCause::worker_quarantined, true);»", ";",
     "a quarantined worker keeps its leases", DOMAIN),
    (48, "coordinator/domain/farm/farm_units.cpp", "if («quarantined.contains(event.worker)») return unwanted(\"the worker is quarantined\");", "false",
     "results of a quarantined worker are accepted", DOMAIN),
    # ---- authorisation
    (49, "coordinator/http/auth/auth.cpp", "if (unsafe(request.method) && («!same_site || cross_site(request)»))", "cross_site(request)",
     "a cookie changes something without a word on where the request comes from", HTTP),
    (50, "coordinator/http/auth/auth.cpp", "if (site == \"cross-site\" || «site == \"same-site\"») return true;", "false", "pages of a sister domain act with the user's cookie", HTTP),
    (51, "coordinator/http/auth/auth.cpp", "return «session.expiry > now_()» ? std::optional(session)", "true", "sessions never end", HTTP),
    (52, "coordinator/http/auth/auth.cpp", "auto caller = open && «!is_closed(*open)» ?", "true", "a closed session goes on", HTTP),
    (53, "coordinator/http/auth/auth.cpp", "if («!equal_secret(cookie.substr(last + 1), mac(text))») return std::nullopt;", "false", "sessions may be forged", HTTP),
    (54, "coordinator/http/auth/auth.cpp", "«throttle_.failed(address, now);»", ";", "tokens may be guessed without end", HTTP),
    (55, "coordinator/http/auth/auth.cpp", "if («caller->role == Role::join») return problem(403,", "false", "a worker's join token opens the API", HTTP),
    (56, "coordinator/http/api/api.cpp", "if (owner && «request.caller.sees(*owner)») return std::nullopt;", "true", "users read and change each other's jobs", HTTP),
    (57, "coordinator/http/api/job_handlers.cpp", "asked.visible = [&request](const std::string& owner) { return «request.caller.sees(owner)»; };", "true",
     "users see each other's jobs in the list", HTTP),
    (58, "coordinator/http/api/routes.cpp", "if (role == Role::read) return access == Access::token || «access == Access::see»;", "access != Access::admin",
     "a token that only reads submits jobs", HTTP),
    (59, "coordinator/http/auth/auth.cpp", "if (!job->is_null() && «caller.sees(event.owner)») return event;", "true",
     "events of workers tell users of each other's jobs", HTTP),
    (60, "coordinator/http/api/job_handlers.cpp", "if (caller.role != Role::submit || «priority <= api.limits().user_priority») return std::nullopt;", "true",
     "a user may go before all others", HTTP),
    # ---- terms
    (101, "worker/render/integrator/surface_nee.h", "if («!world_.lights.can_sample() || !surface.smooth») return;\n  const Group g", "true", "no next-event estimation at surfaces", TABLE),
    (102, "worker/render/integrator/vertex_nee.h", "const Lights& lights = path.world_.lights;\n    if («!lights.can_sample()») return;", "true",
     "no next-event estimation at vertices in media", TABLE),
    (103, "worker/render/integrator/vertex_nee.h", "if («!choice.has_place || (points_only(medium) && !choice.is_point)») return;", "true",
     "no equi-angular sampling in media", TABLE),
    (104, "worker/render/integrator/segment_nee.h", "const auto light = path.sample_light(choice, p);\n    if («!light || !path.turn_to(choice, medium)») return;", "true",
     "no next-event estimation in media by volpath_distant_mis", TABLE),
    (105, "worker/render/integrator/medium_crossing.h", "if («medium.emission_kind == EmissionKind::none || (depth_ == 0 && world_.hide_emitters)») return;", "true", "media give off no light", TABLE),
    (106, "worker/render/integrator/light_hits.h", "if («!world_.lights.has_environment()») return;", "true",
     "paths that leave the scene find no environment", TABLE),
    (107, "worker/render/integrator/light_hits.h", "if («depth_ == 0 && world_.hide_emitters») return;\n  if constexpr", "true", "paths find no lights with an extent", TABLE),
    (108, "worker/render/integrator/light_hits.h", "weight = balance_weight(last_.pdf, «p_l» * last_.in_medium", "p_l * p_l / last_.pdf",
     "found lights are weighted by the power heuristic, next-event estimation by the balance heuristic", TABLE),
    (109, "worker/render/media/medium.h", "f.weight[c] = f.weight[c] * «m.sigma_s[c]» / s;", "m.sigma_t[c]", "chromatic media forget their albedo", TABLE),
    (110, "worker/render/media/medium.h", "f.weight[c] = «scattering[c]» / s;\n      }", "m.sigma_t[c]", "grey grids forget their albedo", TABLE),
    (111, "worker/render/integrator/vertex_nee.h", "const PhaseValue<F> phase = «medium.phase_value<F>(p, d, light->direction)»;", "PhaseValue<F>{typename PhaseValue<F>::Colour(kInvFourPi), kInvFourPi}",
     "next-event estimation in media takes every phase function for an even one", TABLE),
    (112, "worker/render/integrator/medium_crossing.h", "PhaseSample s = «medium.sample_phase<F>(last_.p, ray_.d, u, beta_)»;",
     "HenyeyGreenstein{0}.sample(ray_.d, u)", "paths scatter evenly in all media", TABLE),
    (113, "worker/render/integrator/path_tracer.h", "«beta_ *= s->weight;»\n  }\n  if (s->transmitted)", ";", "surfaces take nothing of the light that they scatter", TABLE),
    (114, "worker/render/integrator/shadow_ray.h", "«value *= through;»", ";", "media throw no shadow", TABLE),
    (115, "worker/render/integrator/path_tracer.h", "bool may_scatter() const { return world_.depth_allows(depth_ + «1»); }", "2", "the last scattering in media is left out", TABLE),
    (116, "worker/render/integrator/path_tracer.h", "if (!may_go_on(depth_ + «1», passed_)) return {Collision::absorbed};\n  see_surface(hit.p);\n  ++depth_;", "2", "the last scattering on surfaces is left out", TABLE),
    (117, "worker/render/integrator/path_tracer.h", "if (s->transmitted) eta_scale_ *= «s->eta * s->eta»;", "1.f", "roulette forgets what refraction does to radiance; unbiased", TABLE),
    (118, "worker/render/integrator/mis.h", "heuristic == MisHeuristic::power ? «ratio * ratio» : ratio", "ratio", "the power heuristic has the exponent 1; unbiased", ("render_test",)),
    # ---- techniques
    (201, "worker/render/integrator/path_reuse.h", "if (lit > 0) light += s.lit * tail.light / «lit»;\n", "(1.05f * lit)",
     "what next-event estimation finds at shared second vertices is 5 % too dark", IMAGES[1:]),
    (202, "worker/render/integrator/vertex_nee.h", "(phase.value * weight / (light->pdf * «traced»)),", "1.f",
     "faint shadow rays that survive roulette are not weighted up", IMAGES[:1]),
    (203, "worker/render/integrator/medium_crossing.h", "refer_to_first_vertex();\n      «beta_ *= .5f;»", "beta_ *= .51f;",
     "the two halves of a split path are more than the whole", IMAGES[:1]),
    (204, "worker/render/integrator/surface_nee.h", "add(beta_ * s->weight * arriving * «.5f», world_", ".52f",
     "second directions that look for the sky count 4 % too much", IMAGES[:1]),
    (205, "worker/render/lights/portals.cpp", "return sum > 0 ? «sum / weight_in_front_of(p)» : 0;", "1.05f * sum / weight_in_front_of(p)",
     "the stated density of portals is 5 % too high", IMAGES[:1]),
    (206, "worker/render/lights/local_lights.cpp", "return {light, «probability_in_table(last, light)»};", "1.02f * probability_in_table(last, light)",
     "the stated probability of a light chosen by place is 2 % too high", IMAGES[:1]),
    (207, "worker/render/integrator/vertex_connection.h", "C3 added = beta_ * value * y.light * (weight * «choice.weight»);", "1.02f * choice.weight",
     "light vertices are 2 % too bright", IMAGES[1:]),
    (208, "worker/render/lights/light_tree.cpp", "return {nodes_[i].light, «words»};", "words + words / 100",
     "the stated probability of a light of the tree is 1 % too high", IMAGES[:1]),
    (209, "worker/render/integrator/emission_nee.h", "add_emission_at(*found, beta_ * f.f_cos * (1 / («found->pdf» + sampled)), ray,", "1.02f * found->pdf",
     "light of grids found by next-event estimation is 2 % too dark", IMAGES[:1]),
    (210, "worker/render/integrator/segment_nee.h", "path.add(path.beta_ * scattering * through * arriving * (phase.value * weight / (light->pdf * «own»)),", "1.02f * own",
     "light at points on camera segments is 2 % too dark", IMAGES[:1]),
    (211, "worker/render/integrator/vertex_nee.h", "(phase.value * weight / (light->pdf * «s.pdf»)),\n", "1.02f * s.pdf",
     "light at points that are sampled equi-angularly is 2 % too dark", IMAGES[:1]),
    (212, "worker/render/integrator/segment_nee.h", "const float by_depth = «e_depth * v.points»;", "1.05f * e_depth * v.points",
     "the stated number of points by depth on segments is 5 % too high", IMAGES[:1]),
]

MUTANTS = [Mutant(*row) for row in ROWS]


def area_of(number):
    return next(area for area, numbers in AREAS.items() if number in numbers)
