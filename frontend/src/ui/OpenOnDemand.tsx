import { Button, Card, Group, Title } from "@mantine/core";
import { type ReactNode, useState } from "react";
import { LazyPart } from "./LazyPart";

interface OpenOnDemandProps {
  title: string;
  /** Label of the button that shows `children`. */
  open: string;
  icon: ReactNode;
  /** Shown while the module of `children` loads. */
  fallback: ReactNode;
  children: ReactNode;
  /** True if `children` are shown at once. */
  startsOpen?: boolean;
  onOpen?: () => void;
}

/** A titled card with a button; `children` load when it is pressed and replace the card. */
export function OpenOnDemand(props: OpenOnDemandProps) {
  const { title, open, icon, fallback, children, startsOpen = false, onOpen } = props;
  const [opened, setOpened] = useState(startsOpen);
  const show = () => {
    setOpened(true);
    onOpen?.();
  };
  if (opened) return <LazyPart loading={fallback}>{children}</LazyPart>;
  return (
    <Card withBorder component="section" aria-label={title}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {title}
        </Title>
        <Button variant="default" h={44} leftSection={icon} onClick={show}>
          {open}
        </Button>
      </Group>
    </Card>
  );
}
