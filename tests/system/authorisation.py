"""Who may do what: the table that test_authorisation.py holds the coordinator to, and docs/reference/authorisation.md is made from.

A row for every operation of the OpenAPI document and every RPC of proto/farm.proto: what each caller is answered. It is
written by hand, apart from the route table of the coordinator, so that the two check each other.
"""

# Callers, left to right. `owner` and `other` have submit tokens; the job that is asked for is the owner's.
CALLERS = {
    "none": "no token",
    "wrong": "a wrong token",
    "join": "a worker's join token",
    "read": "read",
    "owner": "submit, its own job",
    "other": "submit, another's job",
    "admin": "admin",
}


def row(none, wrong, join, read, owner, other, admin, why=""):
    return {"none": none, "wrong": wrong, "join": join, "read": read, "owner": owner, "other": other, "admin": admin,
            "why": why}


def everybody(status, why=""):
    return row(*[status] * 7, why)


def known(status, why=""):  # every token but a worker's
    return row(401, 401, 403, status, status, status, status, why)


def of_job(status, why=""):  # what belongs to one job, to be seen
    return row(401, 401, 403, status, status, 404, status, why)


def changes_job(status, why=""):
    return row(401, 401, 403, 403, status, 404, status, why)


def hands_in(status, why=""):
    return row(401, 401, 403, 403, status, status, status, why)


def admins(status, why=""):
    return row(401, 401, 403, 403, 403, 403, status, why)


ROUTES = {
    "get /healthz": everybody(200, "probes have no token; it says `ok`"),
    "get /readyz": everybody(200, "the same; why not, where it is not, in a sentence"),
    "get /metrics": row(401, 401, 403, 200, 403, 403, 200, "figures of all users together: a monitor gets a read token"),
    "get /api/v1/openapi.json": known(200),
    "get /api/v1/session": known(200, "role and user, for pages that offer no more than that"),
    "post /api/v1/session": row(400, 401, 403, 204, 204, 204, 204, "the token is in the body; wrong ones are counted"),
    "delete /api/v1/session": everybody(204, "forgets the cookie that comes with it"),
    "get /api/v1/jobs": known(200, "to a submit token its own jobs alone"),
    "post /api/v1/jobs": hands_in(201, "the job belongs to the user of the token"),
    "get /api/v1/jobs/{id}": of_job(200),
    "patch /api/v1/jobs/{id}": changes_job(200),
    "delete /api/v1/jobs/{id}": changes_job(204),
    "get /api/v1/jobs/{id}/image.exr": of_job(200),
    "get /api/v1/jobs/{id}/deep.exr": of_job(409, "409: it has no deep image"),
    "get /api/v1/jobs/{id}/image.png": of_job(200),
    "get /api/v1/jobs/{id}/mix": of_job(409, "409: it has no light groups"),
    "get /api/v1/jobs/{id}/error.png": of_job(200),
    "get /api/v1/jobs/{id}/samples.png": of_job(200),
    "get /api/v1/jobs/{id}/thumbnail.png": of_job(200),
    "post /api/v1/jobs/{id}/again": changes_job(201, "the job belongs to who asks"),
    "get /api/v1/jobs/{id}/video": of_job(200),
    "post /api/v1/jobs/{id}/video": changes_job(409, "409: the job is a single image"),
    "get /api/v1/jobs/{id}/video.mp4": of_job(409, "409: it has no video"),
    "get /api/v1/jobs/{id}/layers": of_job(200),
    "get /api/v1/jobs/{id}/pixels": of_job(200),
    "get /api/v1/jobs/{id}/meters": of_job(200),
    "get /api/v1/jobs/{id}/report": of_job(200),
    "get /api/v1/jobs/{id}/report.html": of_job(200),
    "get /api/v1/jobs/{id}/convergence.csv": of_job(200),
    "get /api/v1/jobs/{id}/tiles": of_job(200),
    "get /api/v1/jobs/{id}/log": of_job(200),
    "get /api/v1/jobs/{id}/events": of_job(200),
    "get /api/v1/events": known(200, "to a submit token events of its own jobs, and of workers without what they do for others"),
    "get /api/v1/announced": known(200, "to a submit token its own user's alone"),
    "put /api/v1/announced/{announcement}": hands_in(204, "an announcement belongs to the user of the token"),
    "delete /api/v1/announced/{announcement}": hands_in(404, "404: there is no such announcement of this user in this test"),
    "get /api/v1/workers": known(200, "to a submit token without what they do for others"),
    "patch /api/v1/workers/{worker}": admins(404, "404: there is no such worker in this test"),
    "get /api/v1/workers/{worker}/log": row(401, 401, 403, 404, 403, 403, 404, "it names jobs of all users; 404: there is no such worker in this test"),
    "get /api/v1/views": known(200),
    "get /api/v1/views/cube": known(400, "400: this test names no view"),
    "get /api/v1/tokens": admins(200, "ids, roles and users; no secret is kept that could be told"),
    "post /api/v1/tokens": admins(201),
    "delete /api/v1/tokens/{token}": admins(204),
    "post /api/v1/blobs/missing": known(200, "who knows a file's SHA-256 learns whether it is here"),
    "head /api/v1/blobs/{sha256}": known(200, "the same; no route gives a blob's bytes"),
    "put /api/v1/blobs/{sha256}": hands_in(201),
}

RPC_CALLERS = {
    "none": "no token",
    "wrong": "a wrong token",
    "read": "read",
    "owner": "submit",
    "admin": "admin",
    "join": "join",
}
REFUSED, TAKEN = "UNAUTHENTICATED", "OK"


def workers_only(why):
    return {"none": REFUSED, "wrong": REFUSED, "read": REFUSED, "owner": REFUSED, "admin": REFUSED, "join": TAKEN, "why": why}


RPCS = {
    "Work": workers_only("the token is in the hello; before it nothing is told"),
    "FetchBlob": workers_only("a worker may fetch any blob whose SHA-256 it knows: it is told those of its units"),
}


def cells(entry, callers):
    return " | ".join(str(entry[c]) for c in callers)


def page():
    """docs/reference/authorisation.md."""
    out = [
        "# Who may do what",
        "",
        "Made from `tests/system/authorisation.py` by `LIGHTSHAFT_UPDATE_DOCS=1 pytest tests/system/test_authorisation.py`; the test asks a",
        "running coordinator every cell of both tables, with the bearer token and with a session, GET routes with HEAD as well, and fails on a",
        "route of the OpenAPI document or an RPC that has no row.",
        "",
        "401: nobody we know. 403: we know you, and your role may not. 404: the same words whether there is no such job or it is another's, so that",
        "a submit token cannot find out what others have. 429 (not in the table): too many requests of one token or address, or too many wrong",
        "tokens from one address. `OPTIONS`, unknown addresses outside `/api` and the dashboard's files are open to everybody; an unknown address",
        "under `/api` asks for a token first.",
        "",
        "## HTTP",
        "",
        "| | " + " | ".join(CALLERS.values()) + " | |",
        "|" + "---|" * (len(CALLERS) + 2),
    ]
    for operation, entry in ROUTES.items():
        method, path = operation.split()
        out.append(f"| `{method.upper()} {path}` | {cells(entry, CALLERS)} | {entry['why']} |")
    out += [
        "",
        "## gRPC, for workers",
        "",
        "With `--tls` a client certificate of the farm's authority is needed besides: without one there is no connection, so no row.",
        "",
        "| | " + " | ".join(RPC_CALLERS.values()) + " | |",
        "|" + "---|" * (len(RPC_CALLERS) + 2),
    ]
    out += [f"| `{name}` | {cells(entry, RPC_CALLERS)} | {entry['why']} |" for name, entry in RPCS.items()]
    return "\n".join(out) + "\n"
