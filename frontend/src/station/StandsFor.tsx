import { Alert, Button, Group, List, Modal, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconRotate2 } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useOperates } from "../access/hooks";
import { api, type Schemas } from "../api/client";
import { useAlive, useLive } from "../live/hooks";
import { ProblemNote } from "../shared/problem";

type Side = Schemas["Live"]["side"];

/** Which shoulder the apparatus stands for. Turning it is work for hands; here somebody says that it has been done. */
export function StandsFor({ wanted }: { wanted: Side | undefined }) {
  const operates = useOperates();
  const alive = useAlive();
  const mode = useLive("mode");
  const side = useLive("side");
  const [asking, dialog] = useDisclosure(false);
  const other: Side = side === "right" ? "left" : "right";
  const turn = useMutation({ mutationFn: () => api.turn(other), onSuccess: dialog.close });
  const differs = wanted !== undefined && wanted !== side;
  const button = operates && (
    <Button
      size="md"
      variant={differs ? "filled" : "default"}
      leftSection={<IconRotate2 size={22} />}
      disabled={!alive || mode !== "idle"}
      onClick={dialog.open}
    >
      Turned to the {other} shoulder …
    </Button>
  );
  return (
    <div className={alive ? "" : "stale"}>
      {differs ? (
        <Alert variant="outline" color="gray" title={`The apparatus stands for the ${side} shoulder`}>
          <Group justify="space-between">
            <Text>The patient's {wanted} one is treated.</Text>
            {button}
          </Group>
        </Alert>
      ) : (
        <Group justify="space-between">
          <Text>The apparatus stands for the {side} shoulder</Text>
          {button}
        </Group>
      )}
      <Modal opened={asking} onClose={dialog.close} title={`For the ${other} shoulder`} size="lg">
        <Stack>
          <Text>Motors 3 and 4 turn the other way round on the other shoulder. Before anything moves:</Text>
          <List>
            <List.Item>The patient's arm is out of the apparatus.</List.Item>
            <List.Item>
              The apparatus is turned by 180 degrees, and its pin is locked for the {other} side.
            </List.Item>
            <List.Item>The arm that is to be treated lies in the apparatus, and hangs down.</List.Item>
          </List>
          <ProblemNote error={turn.error} />
          <Group>
            <Button size="xl" loading={turn.isPending} onClick={() => turn.mutate()}>
              It stands for the {other} shoulder
            </Button>
            <Button size="xl" variant="default" onClick={dialog.close}>
              Not now
            </Button>
          </Group>
        </Stack>
      </Modal>
    </div>
  );
}
