import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterEach, describe, expect, it, vi } from "vitest";
import { formatDeg, formatDuration } from "../format";
import { api, ProblemError } from "./client";

afterEach(() => vi.unstubAllGlobals());

const failure = async (call: Promise<unknown>): Promise<ProblemError> => {
  try {
    await call;
  } catch (error) {
    if (error instanceof ProblemError) return error;
  }
  throw new Error("no problem was thrown");
};

describe("the client", () => {
  it("matches the service's OpenAPI document", () => {
    const generated = join(mkdtempSync(join(tmpdir(), "kata-")), "schema.d.ts");
    execFileSync("node_modules/.bin/openapi-typescript", ["openapi.json", "-o", generated]);
    expect(readFileSync("src/lib/api/schema.d.ts", "utf8"), "stale: npm run client").toBe(
      readFileSync(generated, "utf8"),
    );
  }, 30_000);

  it("throws a problem with message, next step and fields", async () => {
    const problem = {
      detail: "Please check what was entered: name is needed.",
      code: "invalid",
      next_step: "",
      errors: [{ pointer: "#/name", detail: "is needed" }],
    };
    vi.stubGlobal("fetch", async () => Response.json(problem, { status: 422 }));
    const error = await failure(api.patient("x"));
    expect(error.message).toBe(problem.detail);
    expect(error.code).toBe("invalid");
    expect(error.fields).toEqual({ name: "is needed" });
  });

  it("reports a service that does not answer", async () => {
    vi.stubGlobal("fetch", async () => {
      throw new TypeError("Failed to fetch");
    });
    const error = await failure(api.patient("x"));
    expect(error.code).toBe("no_connection");
    expect(error.nextStep).not.toBe("");
  });

  it("fetches every page of a patient's recordings", async () => {
    const urls: string[] = [];
    vi.stubGlobal("fetch", async (request: Request) => {
      urls.push(new URL(request.url).search);
      return Response.json(urls.length === 1 ? { items: ["a"], next: "b" } : { items: ["c"], next: null });
    });
    expect(await api.recordings("x")).toEqual({ items: ["a", "c"] });
    expect(urls).toEqual(["?limit=200", "?limit=200&after=b"]);
  });

  it("reports an invalid answer", async () => {
    vi.stubGlobal("fetch", async () => new Response("{}", { status: 502 }));
    expect((await failure(api.patient("x"))).message).toContain("cannot be understood");
  });
});

describe("numbers", () => {
  it.each([
    [-1.25, "−1.3"],
    [0, "0.0"],
    [-0.01, "0.0"],
    [null, "–"],
  ])("shows %s deg as %s", (value, shown) => {
    expect(formatDeg(value)).toBe(shown);
  });

  it("rounds the remaining time up", () => {
    expect(formatDuration(75.2)).toBe("1\u00a0min 16\u00a0s");
    expect(formatDuration(0.1)).toBe("1\u00a0s");
    expect(formatDuration(0)).toBe("0\u00a0s");
    expect(formatDuration(120)).toBe("2\u00a0min");
  });
});
