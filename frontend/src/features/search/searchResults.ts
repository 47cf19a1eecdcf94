import { useDebouncedValue } from "@mantine/hooks";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { PAGES, type Page } from "../../app/pages";
import { api, type Patient } from "../../lib/api/client";
import { midnight } from "../../lib/days";
import { formatDay, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { readDay } from "../../lib/readDay";
import { ADMINISTRATION_PAGES } from "../administration/administrationPages";
import type { Permission } from "../auth/hooks";
import { UNSIGNED } from "../sessions/sessionFilters";

/** The page to which a result leads. `search` is the query of its address. */
export type Target = { to: string; search?: Record<string, unknown> };
/** One line of the search: its name, a detail that distinguishes it from others, and its target. */
export type Result = { id: string; words: string; detail?: string; target: Target };
type ResultGroup = { title: string; results: Result[] };

const [PATIENTS, OF_PATIENT, SESSIONS] = [6, 3, 8];
const DEBOUNCE_MS = 150;

/** Pages that users find by name. Those for which the user lacks the permission are left out. */
const FOUND_PAGES: (Page & { detail?: string })[] = [
  ...PAGES,
  { to: "/account", label: t("auth:menu.account"), needs: "own_account" },
  // The clinic's settings have the same name as its figures.
  ...ADMINISTRATION_PAGES.map((page) => ({ ...page, detail: t("common:shell.administration") })),
];

/** Actions that users find by name and that need no patient. */
const ACTIONS: (Page & { search: Record<string, unknown> })[] = [
  {
    to: "/patients",
    label: t("patients:patients.add"),
    needs: "write_records",
    search: { register: true },
  },
  {
    to: "/sessions",
    label: t("search:actions.unsigned"),
    needs: "read_records",
    search: { note: UNSIGNED },
  },
];

/** Return those whose name contains every typed word, and that the user may open. If nothing is typed, return all. */
function named<Named extends Page>(all: Named[], typed: string, permissions: readonly Permission[]): Named[] {
  const wanted = typed.normalize("NFKC").toLocaleLowerCase().split(/\s+/);
  return all.filter(({ label, needs }) => {
    const name = label.normalize("NFKC").toLocaleLowerCase();
    return permissions.includes(needs) && wanted.every((word) => name.includes(word));
  });
}

const findActions = (typed: string, permissions: readonly Permission[]): Result[] =>
  named(ACTIONS, typed, permissions).map(({ label, to, search }) => ({
    id: `action ${label}`,
    words: label,
    target: { to, search },
  }));

/** Return the pages whose name contains every typed word. If nothing is typed, return all. */
export function findPages(typed: string, permissions: readonly Permission[]): Result[] {
  return named(FOUND_PAGES, typed, permissions).map(({ label, to, detail }) => ({
    id: to,
    words: label,
    ...(detail && { detail }),
    target: { to },
  }));
}

/** Return a typed day in the form 2026-11-05, or null if the text is not a day. */
function typedDay(typed: string): string | null {
  const read = readDay(typed);
  return "day" in read ? read.day : null;
}

/** Search patients, sessions and recordings that the user may read, and pages. */
export function useSearchResults(typed: string, permissions: readonly Permission[]) {
  const [words] = useDebouncedValue(typed.trim(), DEBOUNCE_MS);
  const canReadRecords = permissions.includes("read_records");
  const day = typedDay(words);
  const patients = useQuery({
    queryKey: ["patients", words, false, "first"],
    queryFn: () => api.patients(words, false),
    enabled: canReadRecords && words !== "",
    placeholderData: keepPreviousData,
  });
  const found = words === "" ? [] : (patients.data?.items ?? []);
  const [best] = found;
  const sessions = useQuery({
    queryKey: ["sessions", "searched", day ?? best?.id],
    queryFn: () =>
      day
        ? api.sessions({ since: midnight(day, 0), until: midnight(day, 1) })
        : api.patientSessions(best?.id ?? "", null, OF_PATIENT),
    enabled: canReadRecords && (day !== null || best !== undefined),
  });
  const recordings = useQuery({
    queryKey: ["recordings", best?.id],
    queryFn: () => api.recordings(best?.id ?? ""),
    enabled: canReadRecords && best !== undefined,
  });
  const sessionResults = (sessions.data?.items ?? []).slice(0, SESSIONS).map(
    ({ id, started_at, patient }): Result => ({
      id,
      words: formatMoment(started_at),
      detail: patient.name,
      target: { to: `/sessions/${id}` },
    }),
  );
  const recordingResults = (recordings.data?.items ?? [])
    .filter(({ archived_at }) => !archived_at)
    .slice(0, OF_PATIENT)
    .map(
      ({ id, name }): Result => ({
        id,
        words: name,
        ...(best && { detail: best.name }),
        target: { to: `/recordings/${id}` },
      }),
    );
  const groups: ResultGroup[] = [
    { title: t("search:groups.patients"), results: found.slice(0, PATIENTS).map(patientResult) },
    { title: t("search:groups.actions"), results: best ? actionsFor(best, permissions) : [] },
    { title: t("search:groups.sessions"), results: day || best ? sessionResults : [] },
    { title: t("search:groups.recordings"), results: best ? recordingResults : [] },
    { title: t("search:groups.pages"), results: findPages(words, permissions) },
    { title: t("search:groups.otherActions"), results: findActions(words, permissions) },
  ];
  return {
    groups: groups.filter(({ results }) => results.length > 0),
    searching: patients.isFetching || words !== typed.trim(),
    error: patients.error ?? sessions.error ?? recordings.error,
  };
}

function patientResult({ id, name, kana, clinic_number, birth_date }: Patient): Result {
  return {
    id,
    words: name,
    detail: [kana, clinic_number, birth_date && formatDay(birth_date)].filter(Boolean).join(" · "),
    target: { to: `/patients/${id}` },
  };
}

/** Return the actions that are possible for the patient who matches best. */
function actionsFor({ id, name, episode_id }: Patient, permissions: readonly Permission[]): Result[] {
  const may = (permission: Permission) => permissions.includes(permission);
  return [
    ...(may("operate")
      ? [
          {
            id: `station ${id}`,
            words: t("search:actions.station", { name }),
            target: { to: "/station", search: { patient: id } },
          },
        ]
      : []),
    ...(may("write_records") && episode_id
      ? [
          {
            id: `assess ${id}`,
            words: t("search:actions.assessments", { name }),
            target: { to: `/patients/${id}`, search: { tab: "assessments" } },
          },
        ]
      : []),
  ];
}
