import createClient from "openapi-fetch";
import { t } from "../i18n";
import { translateServerText } from "../serverText";
import type { paths } from "./schema";
import type { Schemas } from "./types";

/** An error answer of the service with a message and a next step. */
export class ProblemError extends Error {
  readonly code: string;
  readonly nextStep: string;
  /** Error messages by field name. */
  readonly fields: Record<string, string>;
  /** Error messages by place in the request, for example "limits/0/highest_deg". */
  readonly byPointer: Record<string, string>;
  /** Error messages by place in a file: line and column, or a path. */
  readonly places: { place: string; problem: string }[];

  constructor(problem: Partial<Schemas["Problem"]>) {
    super(
      problem.detail === undefined
        ? t("common:unheard.unclear")
        : translateServerText(problem.detail, problem.detail_key),
    );
    this.code = problem.code ?? "unknown";
    this.nextStep = translateServerText(problem.next_step ?? "", problem.next_step_key);
    this.fields = Object.fromEntries(
      (problem.errors ?? []).map((error) => [
        error.pointer.split("/").at(-1) ?? "",
        translateServerText(error.detail, error.detail_key),
      ]),
    );
    this.byPointer = Object.fromEntries(
      (problem.errors ?? []).map((error) => [
        error.pointer.replace(/^#?\//, ""),
        translateServerText(error.detail, error.detail_key),
      ]),
    );
    this.places = (problem.errors ?? []).map((error) => ({
      place: error.field_key ? translateServerText(error.field, error.field_key) : error.pointer,
      problem: translateServerText(error.detail, error.detail_key),
    }));
  }
}

/**
 * The HTTP client of all calls. authMiddleware is registered here. `fetch` is looked up at each call, so that
 * tests can replace it.
 */
export const client = createClient<paths>({
  baseUrl: location.origin,
  fetch: (request) => fetch(request),
});

/** Return the data of the answer, or throw the problem. */
export async function unwrap<T>(
  request: Promise<{ data?: T; error?: unknown; response: Response }>,
): Promise<NonNullable<T>> {
  let result: { data?: T; error?: unknown };
  try {
    result = await request;
  } catch {
    throw new ProblemError({
      code: "no_connection",
      detail: t("common:unheard.silent"),
      next_step: t("common:unheard.check"),
    });
  }
  if (result.data === undefined || result.data === null) {
    throw new ProblemError((result.error ?? {}) as Partial<Schemas["Problem"]>);
  }
  return result.data;
}

/** Throw the problem of an answer without data. */
export async function expectSuccess(
  request: Promise<{ error?: unknown; response: Response }>,
): Promise<void> {
  await unwrap(
    request.then(({ error, response }) => ({ ...(response.ok ? { data: true } : { error }), response })),
  );
}

/** Return the query that continues a list after its last known row. Without a limit the service chooses one. */
export const startAfter = (after: string | null, limit?: number) => ({
  ...(after !== null && { after }),
  ...(limit !== undefined && { limit }),
});

/**
 * Fetch the items of every page of a list. With `most`, at most so many are returned, and `complete` is false if the list
 * has more.
 */
export async function collectPages<Item>(
  fetchPage: (after: string | null) => Promise<{ items: Item[]; next: string | null }>,
  most = Number.POSITIVE_INFINITY,
): Promise<{ rows: Item[]; complete: boolean }> {
  const rows: Item[] = [];
  let after: string | null = null;
  do {
    const page = await fetchPage(after);
    rows.push(...page.items);
    after = page.next;
  } while (after && rows.length < most);
  return { rows: rows.slice(0, most), complete: !after && rows.length <= most };
}

/** Fetch every page of a list. */
export async function allPages<Item>(
  fetchPage: (after: string | null) => Promise<{ items: Item[]; next: string | null }>,
): Promise<{ items: Item[] }> {
  const { rows } = await collectPages(fetchPage);
  return { items: rows };
}
