import { Skeleton, Stack, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ProblemNote } from "../../ui/ProblemNote";
import { SessionFilters } from "./SessionFilters";
import { SessionTable } from "./SessionTable";
import { toQuery } from "./sessionFilters";

/** All sessions, newest first. The address contains the filters. */
export function SessionsPage() {
  useTitle(t("sessions:sessions.title"));
  const filters = useSearch({ from: "/sessions" });
  const navigate = useNavigate({ from: "/sessions" });
  const choices = useQuery({ queryKey: ["session-choices"], queryFn: api.sessionFilterOptions });
  const found = usePagedQuery(["sessions", filters], (after, limit) =>
    api.sessions(toQuery(filters), after, limit),
  );
  return (
    <Stack>
      <Title order={1} size="h2">
        {t("sessions:sessions.title")}
      </Title>
      <SessionFilters
        value={filters}
        choices={choices.data}
        onChange={(search) => void navigate({ search, replace: true })}
      />
      <ProblemNote error={found.error ?? choices.error} />
      {found.isPending && <Skeleton h={200} />}
      {found.items && (
        <SessionTable
          items={found.items}
          withPatient
          narrowed={Object.keys(filters).length > 0}
          more={found.hasNextPage}
          fetchAll={found.fetchAll}
        />
      )}
      <LoadMoreButton list={found} />
    </Stack>
  );
}
