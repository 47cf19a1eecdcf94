import { Button, Group, Table, Text } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { type Assessment, api } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { ProblemNote } from "../../ui/ProblemNote";
import { RequirePermission } from "../auth/RequirePermission";
import { ASSESSMENTS, formatScore } from "./messages";

/** All of them, newest first; what was withdrawn stays to be seen. */
export function AssessmentTable(props: {
  episodeId: string;
  items: Assessment[];
  onEdit: (one: Assessment) => void;
}) {
  const queries = useQueryClient();
  const [sure, setSure] = useState<string | null>(null);
  const withdraw = useMutation({
    mutationFn: (one: Assessment) => api.withdrawAssessment(one.id, one.updated_at),
    onSettled: () => {
      setSure(null);
      void queries.invalidateQueries({ queryKey: ["assessments", props.episodeId] });
      void queries.invalidateQueries({ queryKey: ["progress", props.episodeId] });
    },
  });
  return (
    <>
      <ProblemNote error={withdraw.error} />
      <Table verticalSpacing="xs" aria-label={ASSESSMENTS.title}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{ASSESSMENTS.when}</Table.Th>
            <Table.Th>{ASSESSMENTS.by}</Table.Th>
            <Table.Th ta="right">{ASSESSMENTS.angles}</Table.Th>
            <Table.Th ta="right">{ASSESSMENTS.averagePain}</Table.Th>
            <Table.Th ta="right">{ASSESSMENTS.spadi}</Table.Th>
            <Table.Th />
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {props.items.map((one) => (
            <Table.Tr key={one.id} {...(one.withdrawn_at && { c: "dimmed" })}>
              <Table.Td {...(one.withdrawn_at && { td: "line-through" })}>
                {formatMoment(one.assessed_at)}
              </Table.Td>
              <Table.Td>{one.assessed_by}</Table.Td>
              <Table.Td ta="right">{one.rom.length}</Table.Td>
              <Table.Td ta="right">{one.pain_average ?? "–"}</Table.Td>
              <Table.Td ta="right">{formatScore(one.spadi_score?.total)}</Table.Td>
              <Table.Td>
                {one.withdrawn_at ? (
                  <Text size="sm">{ASSESSMENTS.withdrawn}</Text>
                ) : sure === one.id ? (
                  <Group gap="xs" justify="end">
                    <Button variant="default" onClick={() => setSure(null)}>
                      {ASSESSMENTS.keep}
                    </Button>
                    <Button loading={withdraw.isPending} onClick={() => withdraw.mutate(one)}>
                      {ASSESSMENTS.withdrawSurely}
                    </Button>
                  </Group>
                ) : (
                  <RequirePermission permission="write_records">
                    <Group gap="xs" justify="end">
                      <Button variant="default" onClick={() => props.onEdit(one)}>
                        {ASSESSMENTS.change}
                      </Button>
                      <Button variant="subtle" onClick={() => setSure(one.id)}>
                        {ASSESSMENTS.withdraw}
                      </Button>
                    </Group>
                  </RequirePermission>
                )}
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </>
  );
}
