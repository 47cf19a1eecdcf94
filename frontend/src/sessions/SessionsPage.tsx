import { Skeleton, Stack, Title } from "@mantine/core";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../api/client";
import { More } from "../shared/More";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { SessionTable } from "./SessionTable";

/** What was done, with all patients, newest first. */
export function SessionsPage() {
  useTitle("Sessions");
  const [offset, setOffset] = useState(0);
  const found = useQuery({
    queryKey: ["sessions", offset],
    queryFn: () => api.sessions(offset),
    placeholderData: keepPreviousData,
  });
  return (
    <Stack>
      <Title order={2}>Sessions</Title>
      <ProblemNote error={found.error} />
      {found.isPending && <Skeleton h={200} />}
      {found.data && <SessionTable items={found.data.items} withPatient />}
      <More total={found.data?.total ?? 0} offset={offset} onOffset={setOffset} />
    </Stack>
  );
}
